/* Writes all rows of a loop after each control period; reads rows FIRST to FIRST + COUNT before it, where COUNT is not zero. */
#include <stdio.h>

#include "birthsim.h"

static birthsim_word loop[sizeof(LOOP) / sizeof(birthsim_word)];

int main(void) {
  birthsim_begin(loop, LOOP, sizeof(LOOP) / sizeof(birthsim_word));
  for (int k = 0; k < PERIODS; k++) {
    if (COUNT && fread(loop + BIRTHSIM_HEAD + FIRST, sizeof(birthsim_word), COUNT, stdin) != COUNT) return 1;
    if (birthsim_advance(loop, 1)) return 2;
    fwrite(loop + BIRTHSIM_HEAD, sizeof(birthsim_word), BIRTHSIM_ROWS, stdout);
  }
  return 0;
}
