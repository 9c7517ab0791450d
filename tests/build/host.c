/* Loads nothing: linked with the binary of an FMU (FMI 2.0), it runs 400 periods and prints the bits of every output.
   Compiled with the number of OUTPUTS, and with the value references of the first of them, FIRST, and of force_x, FORCE. */
#include <stdio.h>
#include <string.h>

#include "fmi2Functions.h"

int main(int count, char **given) {
  fmi2Component c = count == 2 ? fmi2Instantiate("one", fmi2CoSimulation, given[1], "", NULL, 0, 0) : NULL;
  if (!c) return 2;
  fmi2SetupExperiment(c, 0, 0, 0, 0, 0);
  fmi2EnterInitializationMode(c);
  fmi2ExitInitializationMode(c);
  fmi2ValueReference out[OUTPUTS], in[2] = {FORCE, FORCE + 1};
  for (int k = 0; k < OUTPUTS; k++) out[k] = FIRST + k;
  for (int k = 0; k < 400; k++) {
    double values[OUTPUTS], force[2] = {(k % 50) / 4.0, -(k % 30) / 3.0};
    unsigned long long bits[OUTPUTS];
    if (fmi2SetReal(c, in, 2, force) != fmi2OK || fmi2DoStep(c, k * 1e-3, 1e-3, 1) != fmi2OK) return 3;
    if (fmi2GetReal(c, out, OUTPUTS, values) != fmi2OK) return 4;
    memcpy(bits, values, sizeof bits);
    for (int j = 0; j < OUTPUTS; j++) printf("%016llx%c", bits[j], j + 1 < OUTPUTS ? ' ' : '\n');
  }
  fmi2FreeInstance(c);
  return 0;
}
