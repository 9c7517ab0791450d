/* FMI 2.0 for co-simulation. What the standard lets a model without events, derivatives and strings leave out is refused. */
#include "fmi2Functions.h"
#include "instance.h"

static fmi2Status refuse(Instance *i, const char *why) {
  fmi2CallbackLogger log = (fmi2CallbackLogger)i->log;
  if (log) log(i->environment, i->name, fmi2Error, "logStatusError", "%s", why);
  return fmi2Error;
}

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char *fmi2GetVersion(void) { return fmi2Version; }

fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String categories[]) {
  (void)c, (void)on, (void)n, (void)categories;
  return fmi2OK; /* errors are always said, and there is nothing else to say */
}

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions *functions, fmi2Boolean visible, fmi2Boolean logging) {
  (void)resources, (void)visible, (void)logging;
  if (type != fmi2CoSimulation || !guid || strcmp(guid, MODEL_TOKEN)) return NULL;
  Instance *i = calloc(1, sizeof *i);
  if (!i) return NULL;
  strncpy(i->name, name ? name : "", sizeof i->name - 1);
  i->environment = functions ? functions->componentEnvironment : NULL;
  i->log = functions ? (void *)functions->logger : NULL;
  model_reset(&i->model);
  return i;
}

void fmi2FreeInstance(fmi2Component c) { free(c); }

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean has_tolerance, fmi2Real tolerance, fmi2Real start,
                               fmi2Boolean has_stop, fmi2Real stop) {
  (void)has_tolerance, (void)tolerance, (void)has_stop, (void)stop;
  Model *m = &((Instance *)c)->model;
  if (m->state != SETTING_UP) return refuse(c, BEFORE);
  m->began = m->time = start;
  return fmi2OK;
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c) {
  if (((Instance *)c)->model.state != SETTING_UP) return refuse(c, BEFORE);
  ((Instance *)c)->model.state = INITIALIZING;
  return fmi2OK;
}

fmi2Status fmi2ExitInitializationMode(fmi2Component c) {
  if (((Instance *)c)->model.state != INITIALIZING) return refuse(c, BEGIN);
  model_begin(&((Instance *)c)->model);
  return fmi2OK;
}

fmi2Status fmi2Terminate(fmi2Component c) {
  ((Instance *)c)->model.state = OVER;
  return fmi2OK;
}

fmi2Status fmi2Reset(fmi2Component c) {
  model_reset(&((Instance *)c)->model);
  return fmi2OK;
}

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference which[], size_t n, fmi2Real values[]) {
  for (size_t k = 0; k < n; k++) {
    const double *place = model_variable(&((Instance *)c)->model, which[k]);
    if (!place) return refuse(c, "no such variable");
    values[k] = *place;
  }
  return fmi2OK;
}

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference which[], size_t n, const fmi2Real values[]) {
  Model *m = &((Instance *)c)->model;
  for (size_t k = 0; k < n; k++) {
    const char *why = model_refusal(m, which[k], values[k]);
    if (why) return refuse(c, why);
  }
  for (size_t k = 0; k < n; k++) *model_variable(m, which[k]) = values[k];
  return fmi2OK;
}

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real now, fmi2Real step, fmi2Boolean no_return) {
  (void)no_return;
  Model *m = &((Instance *)c)->model;
  const char *why = model_advance(m, now, step);
  return why ? refuse(c, why) : fmi2OK;
}

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state) {
  if (!*state) *state = malloc(sizeof(Model));
  if (!*state) return refuse(c, "no memory is left for a copy of the state");
  memcpy(*state, &((Instance *)c)->model, sizeof(Model));
  return fmi2OK;
}

fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state) {
  memcpy(&((Instance *)c)->model, state, sizeof(Model));
  return fmi2OK;
}

fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state) {
  (void)c;
  free(*state);
  *state = NULL;
  return fmi2OK;
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate state, size_t *size) {
  (void)c, (void)state;
  *size = sizeof(Model);
  return fmi2OK;
}

fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size) {
  if (size < sizeof(Model)) return refuse(c, "the bytes are fewer than a state has");
  memcpy(bytes, state, sizeof(Model));
  return fmi2OK;
}

fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[], size_t size, fmi2FMUstate *state) {
  if (size != sizeof(Model)) return refuse(c, "the bytes are not as many as a state has");
  Model read;
  memcpy(&read, bytes, sizeof read);
  const char *why = model_damage(&read);
  if (why) return refuse(c, why);
  if (!*state) *state = malloc(sizeof(Model));
  if (!*state) return refuse(c, "no memory is left for a copy of the state");
  **(Model **)state = read;
  return fmi2OK;
}

/* All variables are real numbers, steps are whole when they return, and there are no derivatives. */
#define NONE(n) ((n) == 0 ? fmi2OK : refuse(c, "all variables are real numbers"))
fmi2Status fmi2GetInteger(fmi2Component c, const fmi2ValueReference w[], size_t n, fmi2Integer v[]) { return (void)w, (void)v, NONE(n); }
fmi2Status fmi2GetBoolean(fmi2Component c, const fmi2ValueReference w[], size_t n, fmi2Boolean v[]) { return (void)w, (void)v, NONE(n); }
fmi2Status fmi2GetString(fmi2Component c, const fmi2ValueReference w[], size_t n, fmi2String v[]) { return (void)w, (void)v, NONE(n); }
fmi2Status fmi2SetInteger(fmi2Component c, const fmi2ValueReference w[], size_t n, const fmi2Integer v[]) { return (void)w, (void)v, NONE(n); }
fmi2Status fmi2SetBoolean(fmi2Component c, const fmi2ValueReference w[], size_t n, const fmi2Boolean v[]) { return (void)w, (void)v, NONE(n); }
fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference w[], size_t n, const fmi2String v[]) { return (void)w, (void)v, NONE(n); }

fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference unknown[], size_t unknowns,
                                        const fmi2ValueReference known[], size_t knowns, const fmi2Real seed[], fmi2Real result[]) {
  (void)unknown, (void)unknowns, (void)known, (void)knowns, (void)seed, (void)result;
  return refuse(c, "there are no derivatives");
}

fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference w[], size_t n, const fmi2Integer order[],
                                       const fmi2Real values[]) {
  (void)w, (void)order, (void)values;
  return n == 0 ? fmi2OK : refuse(c, "there are no derivatives");
}

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference w[], size_t n, const fmi2Integer order[],
                                        fmi2Real values[]) {
  (void)w, (void)order, (void)values;
  return n == 0 ? fmi2OK : refuse(c, "there are no derivatives");
}

#define AT_ONCE "a step is complete when it returns"
fmi2Status fmi2CancelStep(fmi2Component c) { return refuse(c, AT_ONCE); }
fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind s, fmi2Status *v) { return (void)s, (void)v, refuse(c, AT_ONCE); }
fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind s, fmi2Integer *v) { return (void)s, (void)v, refuse(c, AT_ONCE); }
fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind s, fmi2Boolean *v) { return (void)s, (void)v, refuse(c, AT_ONCE); }
fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind s, fmi2String *v) { return (void)s, (void)v, refuse(c, AT_ONCE); }

fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Real *value) {
  if (kind != fmi2LastSuccessfulTime) return refuse(c, AT_ONCE);
  *value = ((Instance *)c)->model.time;
  return fmi2OK;
}
