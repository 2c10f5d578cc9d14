/* Replays a recorded drive through the core, tick by tick as firmware does, and writes its results. */

#include <string.h>

#include "board.h"
#include "monitor.h"
#include "save.h"

/* Start of drive.bin, written by the host; the structs and the ticks follow. */
typedef struct {
    uint32_t vehicle_bytes, params_bytes, signals_bytes; /* on the host */
    uint32_t ticks;
    double rate_hz;
} drive_head;

/* result.bin: one per tick, */
typedef struct {
    oc_output output;
    uint32_t instructions, unused;
} result_row;

/* then, once, */
typedef struct {
    oc_coefficients coefficients;
    oc_state state;
    oc_answer answer;
    uint32_t setup_instructions, answer_instructions;
    uint32_t setup_stack, step_stack, answer_stack; /* bytes, maximum */
    uint32_t save_instructions, restore_instructions, save_stack;
    uint32_t image_bytes;
    uint32_t comes_back; /* 1: the image is the same after restoring and saving */
    uint8_t image[sizeof(oc_state) + OC_SAVE_OVERHEAD];
} result_tail;

enum { NO_FILE = 1, OTHER_LAYOUT = 2, NO_SETUP = 3, CUT_SHORT = 4 };

static drive_head head;
static oc_vehicle vehicle;
static oc_params params;
static result_tail tail;
static uint32_t overhead; /* instructions of the measurement itself */

static oc_error nothing(oc_state *state, const oc_coefficients *c, const oc_signals *tick, oc_output *output) {
    (void)state, (void)c, (void)tick, (void)output;
    return OC_OK;
}

/* A pointer, so that the compiler inlines neither. */
typedef oc_error (*stepper)(oc_state *, const oc_coefficients *, const oc_signals *, oc_output *);

static inline uint32_t measured(stepper step, const oc_signals *tick, oc_output *output) {
    const uint32_t before = board_clock();
    (void)step(&tail.state, &tail.coefficients, tick, output);
    return board_instructions(before, board_clock());
}

static int read_head(int32_t file) {
    if (!board_read(file, &head, sizeof head)) {
        return CUT_SHORT;
    }
    if (head.vehicle_bytes != sizeof vehicle || head.params_bytes != sizeof params ||
        head.signals_bytes != sizeof(oc_signals)) {
        return OTHER_LAYOUT;
    }
    return board_read(file, &vehicle, sizeof vehicle) && board_read(file, &params, sizeof params) ? 0 : CUT_SHORT;
}

static int set_up(void) {
    board_stack_paint();
    const uint32_t before = board_clock();
    const oc_error error = oc_setup(&tail.coefficients, &vehicle, &params, head.rate_hz);
    tail.setup_instructions = board_instructions(before, board_clock());
    tail.setup_stack = board_stack_used();
    oc_init(&tail.state);
    return error == OC_OK ? 0 : NO_SETUP;
}

static int drive(int32_t from, int32_t to) {
    static stepper volatile empty = nothing, step = oc_step;
    static oc_signals tick;
    static result_row row;
    overhead = measured(empty, &tick, &row.output);
    board_stack_paint();
    for (uint32_t k = 0; k < head.ticks; ++k) {
        if (!board_read(from, &tick, sizeof tick)) {
            return CUT_SHORT;
        }
        row.instructions = measured(step, &tick, &row.output) - overhead;
        if (!board_write(to, &row, sizeof row)) {
            return CUT_SHORT;
        }
    }
    tail.step_stack = board_stack_used();
    return 0;
}

static void save_and_restore(void) {
    static oc_state other;
    static uint8_t again[sizeof tail.image];
    uint32_t sequence;
    board_stack_paint();
    const uint32_t first = board_clock();
    tail.image_bytes = (uint32_t)oc_save(&tail.state, &tail.coefficients, 1, tail.image, sizeof tail.image);
    const uint32_t second = board_clock();
    const oc_image_fault fault = oc_restore(&other, &tail.coefficients, tail.image, sizeof tail.image, &sequence);
    const uint32_t third = board_clock();
    tail.save_stack = board_stack_used();
    tail.save_instructions = board_instructions(first, second);
    tail.restore_instructions = board_instructions(second, third);
    (void)oc_save(&other, &tail.coefficients, sequence, again, sizeof again);
    tail.comes_back = fault == OC_IMAGE_OK && memcmp(again, tail.image, sizeof again) == 0;
}

static int answer(int32_t to) {
    board_stack_paint();
    const uint32_t before = board_clock();
    oc_answer_get(&tail.state, &tail.coefficients, &tail.answer);
    tail.answer_instructions = board_instructions(before, board_clock());
    tail.answer_stack = board_stack_used();
    save_and_restore();
    return board_write(to, &tail, sizeof tail) ? 0 : CUT_SHORT;
}

int main(void) {
    const int32_t from = board_open("drive.bin", 0);
    const int32_t to = board_open("result.bin", 1);
    if (from < 0 || to < 0) {
        return NO_FILE;
    }
    int failed = read_head(from);
    failed = failed ? failed : set_up();
    failed = failed ? failed : drive(from, to);
    failed = failed ? failed : answer(to);
    board_close(from);
    board_close(to);
    return failed;
}
