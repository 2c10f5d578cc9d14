#include "board.h"

enum {
    SYS_OPEN = 0x01, SYS_CLOSE = 0x02, SYS_WRITE = 0x05, SYS_READ = 0x06, SYS_EXIT_EXTENDED = 0x20,
    READ_BINARY = 1, WRITE_BINARY = 5,
    STOPPED_APPLICATION_EXIT = 0x20026
};

/* Registers of ARMv7-M. */
#define CPACR (*(volatile uint32_t *)0xE000ED88u)
#define SYST_CSR (*(volatile uint32_t *)0xE000E010u)
#define SYST_RVR (*(volatile uint32_t *)0xE000E014u)
#define SYST_CVR (*(volatile uint32_t *)0xE000E018u)

/* QEMU runs with -icount shift=6: an instruction is 64 ns of the board's time; its SysTick runs at 25 MHz. */
enum { NS_PER_INSTRUCTION = 64, NS_PER_COUNT = 40, COUNT_MASK = 0xFFFFFF };

static const uint32_t paint = 0xA5A5A5A5u;

extern uint32_t data_load[], data_begin[], data_end[], bss_begin[], bss_end[], stack_top[];

void reset(void);
static void fault(void);

__attribute__((section(".vectors"), used)) static const void *const vectors[16] = {
    stack_top, (const void *)reset, (const void *)fault, (const void *)fault,
    (const void *)fault, (const void *)fault, (const void *)fault,
};

static int32_t semihost(int32_t operation, const void *arguments) {
    register int32_t r0 __asm__("r0") = operation;
    register const void *r1 __asm__("r1") = arguments;
    __asm__ volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
    return r0;
}

int32_t board_open(const char *name, int32_t to_write) {
    uint32_t length = 0;
    while (name[length] != '\0') {
        ++length;
    }
    const uint32_t arguments[3] = {(uint32_t)name, to_write ? WRITE_BINARY : READ_BINARY, length};
    return semihost(SYS_OPEN, arguments);
}

static int32_t transfer(int32_t operation, int32_t file, const void *bytes, uint32_t count) {
    const uint32_t arguments[3] = {(uint32_t)file, (uint32_t)bytes, count};
    return semihost(operation, arguments) == 0; /* semihosting returns the number of bytes not transferred */
}

int32_t board_read(int32_t file, void *bytes, uint32_t count) {
    return transfer(SYS_READ, file, bytes, count);
}

int32_t board_write(int32_t file, const void *bytes, uint32_t count) {
    return transfer(SYS_WRITE, file, bytes, count);
}

void board_close(int32_t file) {
    semihost(SYS_CLOSE, &file);
}

void board_exit(int32_t code) {
    const uint32_t arguments[2] = {STOPPED_APPLICATION_EXIT, (uint32_t)code};
    semihost(SYS_EXIT_EXTENDED, arguments);
    for (;;) {
    }
}

static void fault(void) {
    board_exit(100);
}

uint32_t board_clock(void) {
    return SYST_CVR;
}

uint32_t board_instructions(uint32_t before, uint32_t after) {
    const uint64_t counts = (before - after) & COUNT_MASK;
    return (uint32_t)((counts * NS_PER_COUNT + NS_PER_INSTRUCTION / 2) / NS_PER_INSTRUCTION);
}

static uint32_t *stack_pointer(void) {
    uint32_t *sp;
    __asm__ volatile("mov %0, sp" : "=r"(sp));
    return sp;
}

__attribute__((noinline)) void board_stack_paint(void) {
    volatile uint32_t *top = stack_pointer();
    for (int32_t k = 1; k <= BOARD_STACK_WATCHED / 4; ++k) {
        top[-k] = paint;
    }
}

__attribute__((noinline)) uint32_t board_stack_used(void) {
    volatile uint32_t *top = stack_pointer();
    int32_t k = BOARD_STACK_WATCHED / 4;
    while (k > 0 && top[-k] == paint) {
        --k;
    }
    return (uint32_t)k * 4u;
}

void reset(void) {
    CPACR |= 0xFu << 20; /* the floating point unit */
    __asm__ volatile("dsb\n isb" ::: "memory");
    for (uint32_t *from = data_load, *to = data_begin; to < data_end; ++from, ++to) {
        *to = *from;
    }
    for (uint32_t *to = bss_begin; to < bss_end; ++to) {
        *to = 0;
    }
    SYST_RVR = COUNT_MASK;
    SYST_CVR = 0;
    SYST_CSR = 5; /* on, by the processor's clock, without interrupt */
    board_exit(main());
}
