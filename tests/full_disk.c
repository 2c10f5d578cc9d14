/* Preloaded, it lets the N-th call that takes room on the disk below one folder fail with ENOSPC, as SQLite tests
   its own files; all calls after it go on as before. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/sendfile.h>
#include <sys/types.h>
#include <sys/uio.h>
#include <unistd.h>

#define EXPORTED __attribute__((visibility("default")))
#define NEXT(name) ((__typeof__(&name))dlsym(RTLD_NEXT, #name))

static char folder[4096];
static char calls[1 << 20]; /* their names, one a line: what a failing test shows */
static size_t used; /* of them */
static int count, failing;

/* From here on calls below `path` are counted, and the `number`-th fails; 0: none. */
EXPORTED void full_disk_watch(const char *path, int number)
{
    snprintf(folder, sizeof folder, "%s", path);
    count = 0;
    calls[0] = '\0';
    used = 0;
    failing = number;
}

/* A program that knows nothing of this gets folder and call by its environment. */
__attribute__((constructor)) static void full_disk_watch_from_the_start(void)
{
    const char *path = getenv("FULL_DISK_FOLDER"), *number = getenv("FULL_DISK_CALL");
    if (path != NULL && number != NULL)
        full_disk_watch(path, atoi(number));
}

EXPORTED int full_disk_count(void)
{
    return count;
}

EXPORTED const char *full_disk_calls(void)
{
    return calls;
}

static int is_below(const char *path)
{
    size_t length = strlen(folder);
    return length > 0 && strncmp(path, folder, length) == 0 && (path[length] == '/' || path[length] == '\0');
}

static int is_full(const char *call, const char *path)
{
    if (!is_below(path))
        return 0;
    count++;
    if (used + 512 < sizeof calls)
        used += (size_t)snprintf(calls + used, 512, "%s %s\n", call, strrchr(path, '/'));
    if (count != failing)
        return 0;
    errno = ENOSPC;
    return 1;
}

static int is_full_for(const char *call, int file)
{
    char link[64], path[4096];
    ssize_t length;
    int before = errno;
    if (folder[0] == '\0')
        return 0;
    snprintf(link, sizeof link, "/proc/self/fd/%d", file);
    length = readlink(link, path, sizeof path - 1);
    errno = before;
    if (length < 0)
        return 0;
    path[length] = '\0';
    return is_full(call, path);
}

#define OF_FILE(result, name, parameters, arguments) \
    EXPORTED result name parameters \
    { \
        return is_full_for(#name, file) ? -1 : NEXT(name) arguments; \
    }

OF_FILE(ssize_t, write, (int file, const void *data, size_t size), (file, data, size))
OF_FILE(ssize_t, pwrite, (int file, const void *data, size_t size, off_t at), (file, data, size, at))
OF_FILE(ssize_t, pwrite64, (int file, const void *data, size_t size, off64_t at), (file, data, size, at))
OF_FILE(ssize_t, writev, (int file, const struct iovec *data, int parts), (file, data, parts))
OF_FILE(ssize_t, pwritev, (int file, const struct iovec *data, int parts, off_t at), (file, data, parts, at))
OF_FILE(ssize_t, pwritev64, (int file, const struct iovec *data, int parts, off64_t at), (file, data, parts, at))
OF_FILE(int, fsync, (int file), (file))
OF_FILE(int, fdatasync, (int file), (file))
OF_FILE(int, ftruncate, (int file, off_t size), (file, size))
OF_FILE(int, ftruncate64, (int file, off64_t size), (file, size))
OF_FILE(ssize_t, sendfile, (int file, int from, off_t *at, size_t size), (file, from, at, size))
OF_FILE(ssize_t, sendfile64, (int file, int from, off64_t *at, size_t size), (file, from, at, size))

EXPORTED ssize_t copy_file_range(int from, off64_t *at, int file, off64_t *to, size_t size, unsigned int flags)
{
    return is_full_for("copy_file_range", file) ? -1 : NEXT(copy_file_range)(from, at, file, to, size, flags);
}

/* posix_fallocate returns its error. */
EXPORTED int posix_fallocate(int file, off_t at, off_t size)
{
    return is_full_for("posix_fallocate", file) ? ENOSPC : NEXT(posix_fallocate)(file, at, size);
}

EXPORTED int posix_fallocate64(int file, off64_t at, off64_t size)
{
    return is_full_for("posix_fallocate64", file) ? ENOSPC : NEXT(posix_fallocate64)(file, at, size);
}

EXPORTED int rename(const char *from, const char *to)
{
    return is_full("rename", to) ? -1 : NEXT(rename)(from, to);
}

EXPORTED int renameat(int in, const char *from, int into, const char *to)
{
    return is_full("renameat", to) ? -1 : NEXT(renameat)(in, from, into, to);
}

EXPORTED int mkdir(const char *path, mode_t mode)
{
    return access(path, F_OK) != 0 && is_full("mkdir", path) ? -1 : NEXT(mkdir)(path, mode);
}

/* A file that is opened takes room only where it may be made. */
static mode_t mode_of(int flags, va_list arguments)
{
    return flags & (O_CREAT | O_TMPFILE) ? va_arg(arguments, mode_t) : 0;
}

#define OPENS(name) \
    EXPORTED int name(const char *path, int flags, ...) \
    { \
        va_list arguments; \
        mode_t mode; \
        va_start(arguments, flags); \
        mode = mode_of(flags, arguments); \
        va_end(arguments); \
        return (flags & O_CREAT) && is_full(#name, path) ? -1 : NEXT(name)(path, flags, mode); \
    }

#define OPENS_AT(name) \
    EXPORTED int name(int in, const char *path, int flags, ...) \
    { \
        va_list arguments; \
        mode_t mode; \
        va_start(arguments, flags); \
        mode = mode_of(flags, arguments); \
        va_end(arguments); \
        return (flags & O_CREAT) && is_full(#name, path) ? -1 : NEXT(name)(in, path, flags, mode); \
    }

OPENS(open)
OPENS(open64)
OPENS_AT(openat)
OPENS_AT(openat64)
