/* Runs a controller alone, as a firmware does in every control period: samples and setpoints in, openings out. */
#include <math.h>
#include <stdio.h>

#include "birthsim.h"

static birthsim_word law[sizeof(BIRTHSIM_CONTROLLER) / sizeof(birthsim_word)];

/* Stands for a tracker, pressure cells and a force sensor: the end effector creeps along x, and for 5 ms a cell says nothing. */
static void measure(int period) {
  birthsim_set(law, BIRTHSIM_TIME, period * BIRTHSIM_PERIOD);
  birthsim_set(law, BIRTHSIM_POSITION_TIME, period * BIRTHSIM_PERIOD);
  birthsim_set(law, BIRTHSIM_MEASURED_X, 0.5 + period / 65536.0);
  birthsim_set(law, BIRTHSIM_MEASURED_Y, 0.0);
  birthsim_set(law, BIRTHSIM_MEASURED_VX, 1.0 / 64.0);
  birthsim_set(law, BIRTHSIM_MEASURED_VY, 0.0);
  birthsim_set(law, BIRTHSIM_MEASURED_PP1, 400000.0);
  birthsim_set(law, BIRTHSIM_MEASURED_PN1, period < 100 || period >= 105 ? 450000.0 : NAN);
  birthsim_set(law, BIRTHSIM_MEASURED_PP2, 400000.0);
  birthsim_set(law, BIRTHSIM_MEASURED_PN2, 450000.0);
  birthsim_set(law, BIRTHSIM_MEASURED_FORCE_X, 2.0);
  birthsim_set(law, BIRTHSIM_MEASURED_FORCE_Y, 0.0);
}

/* A target at rest, with a stiffness; all other rows of the reference are 0 from the start. */
static void ask(void) {
  birthsim_set(law, BIRTHSIM_REFERENCE_X, 0.5);
  birthsim_set(law, BIRTHSIM_REFERENCE_KCLX, 2000.0);
  birthsim_set(law, BIRTHSIM_REFERENCE_KCLY, 2000.0);
  birthsim_set(law, BIRTHSIM_REFERENCE_KPNEU1, 4600.0);
  birthsim_set(law, BIRTHSIM_REFERENCE_KPNEU2, 2300.0);
}

int main(void) {
  birthsim_begin(law, BIRTHSIM_CONTROLLER, sizeof(law) / sizeof(law[0]));
  printf("time, s; openings of P1, N1, P2, N2; missed; fault\n");
  for (int period = 0; period < 200; period++) {
    measure(period);
    ask();
    if (birthsim_advance(law, 1)) {
      fprintf(stderr, "the law cannot render what it is asked for\n");
      return 1;
    }
    printf("%.17g", birthsim_get(law, BIRTHSIM_TIME));
    for (int valve = 0; valve < 4; valve++) printf(" %.17g", birthsim_get(law, BIRTHSIM_OPENING_P1 + valve));
    printf(" %g %g\n", birthsim_get(law, BIRTHSIM_MISSED), birthsim_get(law, BIRTHSIM_FAULT));
  }
  return 0;
}
