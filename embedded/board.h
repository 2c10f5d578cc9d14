#ifndef OC_EMBEDDED_BOARD_H
#define OC_EMBEDDED_BOARD_H
/* What a replay needs of the emulated board: files of the host by ARM semihosting, a count of instructions, and how
 * deep the stack went. */

#include <stdint.h>

enum { BOARD_STACK_WATCHED = 16384 /* bytes below the caller that board_stack_used looks at */ };

/* A file of the host, in the folder QEMU runs in; negative where it cannot be opened. */
int32_t board_open(const char *name, int32_t to_write);
/* Whether all bytes were read or written. */
int32_t board_read(int32_t file, void *bytes, uint32_t count);
int32_t board_write(int32_t file, const void *bytes, uint32_t count);
void board_close(int32_t file);
void board_exit(int32_t code);

/* Counts down, modulo 2^24. */
uint32_t board_clock(void);
/* Instructions between two readings, `before` and `after`, at most some ten million of them. */
uint32_t board_instructions(uint32_t before, uint32_t after);

/* Paints what lies below the stack pointer; later, how many bytes of it were overwritten. */
void board_stack_paint(void);
uint32_t board_stack_used(void);

int main(void);

#endif
