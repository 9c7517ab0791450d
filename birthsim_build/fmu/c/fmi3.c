/* FMI 3.0 for co-simulation. What the standard lets a model without events, derivatives and strings leave out is in fmi3_refused.c. */
#include "fmi3Functions.h"
#include "instance.h"

static fmi3Status refuse(Instance *i, const char *why) {
  fmi3LogMessageCallback log = (fmi3LogMessageCallback)i->log;
  if (log) log(i->environment, fmi3Error, "logStatusError", why);
  return fmi3Error;
}

const char *fmi3GetVersion(void) { return fmi3Version; }

fmi3Status fmi3SetDebugLogging(fmi3Instance c, fmi3Boolean on, size_t n, const fmi3String categories[]) {
  (void)c, (void)on, (void)n, (void)categories;
  return fmi3OK; /* errors are always said, and there is nothing else to say */
}

fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
                                         fmi3Boolean logging, fmi3Boolean events, fmi3Boolean early,
                                         const fmi3ValueReference intermediate[], size_t intermediates,
                                         fmi3InstanceEnvironment environment, fmi3LogMessageCallback log,
                                         fmi3IntermediateUpdateCallback update) {
  (void)resources, (void)visible, (void)logging, (void)events, (void)early, (void)intermediate, (void)intermediates, (void)update;
  if (!token || strcmp(token, MODEL_TOKEN)) return NULL;
  Instance *i = calloc(1, sizeof *i);
  if (!i) return NULL;
  strncpy(i->name, name ? name : "", sizeof i->name - 1);
  i->environment = environment;
  i->log = (void *)log;
  model_reset(&i->model);
  return i;
}

void fmi3FreeInstance(fmi3Instance c) { free(c); }

fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean has_tolerance, fmi3Float64 tolerance, fmi3Float64 start,
                                       fmi3Boolean has_stop, fmi3Float64 stop) {
  (void)has_tolerance, (void)tolerance, (void)has_stop, (void)stop;
  Model *m = &((Instance *)c)->model;
  if (m->state != SETTING_UP) return refuse(c, BEFORE);
  m->began = m->time = start;
  m->state = INITIALIZING;
  return fmi3OK;
}

fmi3Status fmi3ExitInitializationMode(fmi3Instance c) {
  if (((Instance *)c)->model.state != INITIALIZING) return refuse(c, BEGIN);
  model_begin(&((Instance *)c)->model);
  return fmi3OK;
}

fmi3Status fmi3Terminate(fmi3Instance c) {
  ((Instance *)c)->model.state = OVER;
  return fmi3OK;
}

fmi3Status fmi3Reset(fmi3Instance c) {
  model_reset(&((Instance *)c)->model);
  return fmi3OK;
}

fmi3Status fmi3GetFloat64(fmi3Instance c, const fmi3ValueReference which[], size_t n, fmi3Float64 values[], size_t count) {
  if (n != count) return refuse(c, "all variables are single numbers");
  for (size_t k = 0; k < n; k++) {
    const double *place = model_variable(&((Instance *)c)->model, which[k]);
    if (!place) return refuse(c, "no such variable");
    values[k] = *place;
  }
  return fmi3OK;
}

fmi3Status fmi3SetFloat64(fmi3Instance c, const fmi3ValueReference which[], size_t n, const fmi3Float64 values[], size_t count) {
  if (n != count) return refuse(c, "all variables are single numbers");
  Model *m = &((Instance *)c)->model;
  for (size_t k = 0; k < n; k++) {
    const char *why = model_refusal(m, which[k], values[k]);
    if (why) return refuse(c, why);
  }
  for (size_t k = 0; k < n; k++) *model_variable(m, which[k]) = values[k];
  return fmi3OK;
}

fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 now, fmi3Float64 step, fmi3Boolean no_return, fmi3Boolean *event,
                      fmi3Boolean *terminate, fmi3Boolean *early, fmi3Float64 *last) {
  (void)no_return;
  Model *m = &((Instance *)c)->model;
  *event = *terminate = *early = false;
  *last = m->time;
  const char *why = model_advance(m, now, step);
  *last = m->time;
  return why ? refuse(c, why) : fmi3OK;
}

fmi3Status fmi3GetFMUState(fmi3Instance c, fmi3FMUState *state) {
  if (!*state) *state = malloc(sizeof(Model));
  if (!*state) return refuse(c, "no memory is left for a copy of the state");
  memcpy(*state, &((Instance *)c)->model, sizeof(Model));
  return fmi3OK;
}

fmi3Status fmi3SetFMUState(fmi3Instance c, fmi3FMUState state) {
  memcpy(&((Instance *)c)->model, state, sizeof(Model));
  return fmi3OK;
}

fmi3Status fmi3FreeFMUState(fmi3Instance c, fmi3FMUState *state) {
  (void)c;
  free(*state);
  *state = NULL;
  return fmi3OK;
}

fmi3Status fmi3SerializedFMUStateSize(fmi3Instance c, fmi3FMUState state, size_t *size) {
  (void)c, (void)state;
  *size = sizeof(Model);
  return fmi3OK;
}

fmi3Status fmi3SerializeFMUState(fmi3Instance c, fmi3FMUState state, fmi3Byte bytes[], size_t size) {
  if (size < sizeof(Model)) return refuse(c, "the bytes are fewer than a state has");
  memcpy(bytes, state, sizeof(Model));
  return fmi3OK;
}

fmi3Status fmi3DeserializeFMUState(fmi3Instance c, const fmi3Byte bytes[], size_t size, fmi3FMUState *state) {
  if (size != sizeof(Model)) return refuse(c, "the bytes are not as many as a state has");
  Model read;
  memcpy(&read, bytes, sizeof read);
  const char *why = model_damage(&read);
  if (why) return refuse(c, why);
  if (!*state) *state = malloc(sizeof(Model));
  if (!*state) return refuse(c, "no memory is left for a copy of the state");
  **(Model **)state = read;
  return fmi3OK;
}
