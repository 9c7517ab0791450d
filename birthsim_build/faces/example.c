/* Runs two seconds of a closed loop and prints where the end effector is. */
#include <stdio.h>

#include "birthsim.h"

static birthsim_word loop[sizeof(BIRTHSIM_EXAMPLE) / sizeof(birthsim_word)];

int main(void) {
  birthsim_begin(loop, BIRTHSIM_EXAMPLE, sizeof(loop) / sizeof(loop[0]));
  printf("time, s; x, y, m\n");
  for (int k = 0; k < 20; k++) {
    if (birthsim_advance(loop, 100)) {
      fprintf(stderr, "the law cannot render what it is asked for\n");
      return 1;
    }
    printf("%.17g %.17g %.17g\n", birthsim_get(loop, BIRTHSIM_TIME), birthsim_get(loop, BIRTHSIM_X), birthsim_get(loop, BIRTHSIM_Y));
  }
  return 0;
}
