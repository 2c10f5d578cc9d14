#ifndef OC_EMBEDDED_BOARD_H
#define OC_EMBEDDED_BOARD_H
/* Functions of the emulated board for a replay: files of the host by ARM semihosting, count of instructions, depth of
 * the stack. */

#include <stdint.h>

enum { BOARD_STACK_WATCHED = 16384 /* bytes below the caller that board_stack_used checks */ };

/* A file of the host, in QEMU's working folder; negative if it cannot be opened. */
int32_t board_open(const char *name, int32_t to_write);
/* Whether all bytes were read or written. */
int32_t board_read(int32_t file, void *bytes, uint32_t count);
int32_t board_write(int32_t file, const void *bytes, uint32_t count);
void board_close(int32_t file);
void board_exit(int32_t code);

/* Counts down modulo 2^24. */
uint32_t board_clock(void);
/* Instructions between two readings, up to some ten million. */
uint32_t board_instructions(uint32_t before, uint32_t after);

/* Fills the memory below the stack pointer with a pattern; returns later how many bytes of it were overwritten. */
void board_stack_paint(void);
uint32_t board_stack_used(void);

int main(void);

#endif
