/* Runs a controller alone, which is told another rig in the middle of its way. */
#include <stdio.h>

#include "birthsim.h"

static birthsim_word law[sizeof(BIRTHSIM_CONTROLLER) / sizeof(birthsim_word)];

int main(void) {
  double rig[BIRTHSIM_RIG_PARAMETERS];
  birthsim_begin(law, BIRTHSIM_CONTROLLER, sizeof(law) / sizeof(law[0]));
  birthsim_set(law, BIRTHSIM_REFERENCE_X, 0.5);
  birthsim_set(law, BIRTHSIM_REFERENCE_KCLX, 2000.0);
  birthsim_set(law, BIRTHSIM_REFERENCE_KCLY, 2000.0);
  birthsim_set(law, BIRTHSIM_REFERENCE_KPNEU1, 4600.0);
  birthsim_set(law, BIRTHSIM_REFERENCE_KPNEU2, 2300.0);
  for (int chamber = 0; chamber < 4; chamber++) birthsim_set(law, BIRTHSIM_MEASURED_PP1 + chamber, 4e5 + 5e4 * (chamber % 2));
  for (int period = 0; period < 300; period++) {
    birthsim_set(law, BIRTHSIM_TIME, period * BIRTHSIM_PERIOD);
    birthsim_set(law, BIRTHSIM_POSITION_TIME, period * BIRTHSIM_PERIOD);
    birthsim_set(law, BIRTHSIM_MEASURED_X, 0.5 + period / 65536.0);
    birthsim_set(law, BIRTHSIM_MEASURED_VX, 1.0 / 64.0);
    birthsim_set(law, BIRTHSIM_MEASURED_FORCE_X, 2.0);
    if (period == 100) {
      birthsim_rig(rig);
      rig[BIRTHSIM_RIG_MECHANICS_MASS] = 4.5;
      rig[BIRTHSIM_RIG_VALVES_TIME_CONSTANT] = 0.004;
      rig[BIRTHSIM_RIG_CYLINDER1_COULOMB_FRICTION] = 17.0;
      birthsim_believe(law, BELIEF, rig);
    }
    if (birthsim_advance(law, 1)) return 1;
    for (int valve = 0; valve < 4; valve++) printf("%.17g ", birthsim_get(law, BIRTHSIM_OPENING_P1 + valve));
    printf("\n");
  }
  return 0;
}
