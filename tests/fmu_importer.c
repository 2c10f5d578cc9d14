/* The least importer: loads the binary of an FMU, steps it row by row and prints the outputs' bits.
 *
 * fmu_importer BINARY TOKEN DRIVE; of DRIVE, all in hexadecimal: FMI version, step in s, start in s, how many inputs,
 * outputs and rows, value references of both, then the rows. A real is written as its 64 bits. */

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#ifdef _WIN32
#include <windows.h>
static void *symbol(void *library, const char *name) {
    return (void *)GetProcAddress((HMODULE)library, name);
}
static void *load(const char *path) {
    return (void *)LoadLibraryA(path);
}
#else
#include <dlfcn.h>
static void *symbol(void *library, const char *name) {
    return dlsym(library, name);
}
static void *load(const char *path) {
    return dlopen(path, RTLD_NOW | RTLD_LOCAL);
}
#endif

enum { MOST = 32 };

static void *function(void *library, const char *name) {
    void *const found = symbol(library, name);
    if (found == NULL) {
        fprintf(stderr, "no function %s\n", name);
        exit(1);
    }
    return found;
}

static void must(int status, const char *what) {
    if (status != 0) {
        fprintf(stderr, "%s gives %d\n", what, status);
        exit(1);
    }
}

static uint64_t number(FILE *file) {
    uint64_t given;
    if (fscanf(file, "%" SCNx64, &given) != 1) {
        fprintf(stderr, "the drive ends early\n");
        exit(1);
    }
    return given;
}

static double real(FILE *file) {
    const uint64_t given = number(file);
    double value;
    memcpy(&value, &given, sizeof value);
    return value;
}

typedef struct {
    void (*logger)(void *, const char *, int, const char *, const char *, ...);
    void *(*allocate)(size_t, size_t);
    void (*release)(void *);
    void (*finished)(void *, int);
    void *environment;
} callbacks;

static void tell(void *environment, const char *name, int status, const char *category, const char *message, ...) {
    (void)environment, (void)name, (void)category;
    fprintf(stderr, "%d: %s\n", status, message);
}

typedef int (*exchange2)(void *, const uint32_t *, size_t, double *);
typedef int (*exchange3)(void *, const uint32_t *, size_t, double *, size_t);

static int exchange(int fmi, void *call, void *fmu, const uint32_t *references, size_t count, double *values) {
    return fmi == 2 ? ((exchange2)call)(fmu, references, count, values)
                    : ((exchange3)call)(fmu, references, count, values, count);
}

static void *begin(void *library, int fmi, const char *token, double start) {
    static const callbacks all = {tell, calloc, free, NULL, NULL};
    void *fmu;
    if (fmi == 2) {
        typedef void *(*instantiate)(const char *, int, const char *, const char *, const callbacks *, int, int);
        typedef int (*set_up)(void *, int, double, double, int, double);
        typedef int (*plain)(void *);
        fmu = ((instantiate)function(library, "fmi2Instantiate"))("truck", 1, token, NULL, &all, 0, 0);
        must(fmu == NULL, "fmi2Instantiate");
        must(((set_up)function(library, "fmi2SetupExperiment"))(fmu, 0, 0.0, start, 0, 0.0), "fmi2SetupExperiment");
        must(((plain)function(library, "fmi2EnterInitializationMode"))(fmu), "fmi2EnterInitializationMode");
        must(((plain)function(library, "fmi2ExitInitializationMode"))(fmu), "fmi2ExitInitializationMode");
    } else {
        typedef void *(*instantiate)(const char *, const char *, const char *, _Bool, _Bool, _Bool, _Bool,
                                     const uint32_t *, size_t, void *, void *, void *);
        typedef int (*enter)(void *, _Bool, double, double, _Bool, double);
        typedef int (*plain)(void *);
        const instantiate call = function(library, "fmi3InstantiateCoSimulation");
        fmu = call("truck", token, NULL, 0, 0, 0, 0, NULL, 0, NULL, NULL, NULL);
        must(fmu == NULL, "fmi3InstantiateCoSimulation");
        must(((enter)function(library, "fmi3EnterInitializationMode"))(fmu, 0, 0.0, start, 0, 0.0), "initialization");
        must(((plain)function(library, "fmi3ExitInitializationMode"))(fmu), "fmi3ExitInitializationMode");
    }
    return fmu;
}

static void step(void *library, int fmi, void *fmu, double time, double length) {
    if (fmi == 2) {
        typedef int (*take)(void *, double, double, int);
        must(((take)function(library, "fmi2DoStep"))(fmu, time, length, 1), "fmi2DoStep");
    } else {
        typedef int (*take)(void *, double, double, _Bool, _Bool *, _Bool *, _Bool *, double *);
        _Bool event, ended, early;
        double last;
        const take call = function(library, "fmi3DoStep");
        must(call(fmu, time, length, 1, &event, &ended, &early, &last), "fmi3DoStep");
    }
}

int main(int count, char **given) {
    FILE *const drive = count == 4 ? fopen(given[3], "r") : NULL;
    void *const library = drive != NULL ? load(given[1]) : NULL;
    if (library == NULL) {
        fprintf(stderr, "cannot load %s\n", count > 1 ? given[1] : "nothing");
        return 1;
    }
    const int fmi = (int)number(drive);
    const double length = real(drive), start = real(drive);
    const size_t inputs = number(drive), outputs = number(drive), rows = number(drive);
    uint32_t in[MOST], out[MOST];
    double values[MOST];
    must(inputs > MOST || outputs > MOST, "too many variables: this");
    for (size_t k = 0; k < inputs; ++k) {
        in[k] = (uint32_t)number(drive);
    }
    for (size_t k = 0; k < outputs; ++k) {
        out[k] = (uint32_t)number(drive);
    }
    void *const set = function(library, fmi == 2 ? "fmi2SetReal" : "fmi3SetFloat64");
    void *const get = function(library, fmi == 2 ? "fmi2GetReal" : "fmi3GetFloat64");
    void *const fmu = begin(library, fmi, given[2], start);
    for (size_t row = 0; row < rows; ++row) {
        for (size_t k = 0; k < inputs; ++k) {
            values[k] = real(drive);
        }
        must(exchange(fmi, set, fmu, in, inputs, values), "setting the inputs");
        step(library, fmi, fmu, start + (double)row * length, length);
        if (row % 100 == 99 || row + 1 == rows) {
            must(exchange(fmi, get, fmu, out, outputs, values), "getting the outputs");
            for (size_t k = 0; k < outputs; ++k) {
                uint64_t bits;
                memcpy(&bits, &values[k], sizeof bits);
                printf("%016" PRIx64 "%c", bits, k + 1 < outputs ? ' ' : '\n');
            }
        }
    }
    return 0;
}
