/* One instance of the model, as FMI 2 and FMI 3 share it. model.h, which is generated, describes the model. */
#ifndef BIRTHSIM_INSTANCE_H
#define BIRTHSIM_INSTANCE_H

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "model.h"

enum { SETTING_UP, INITIALIZING, RUNNING, OVER };

#define BEFORE "this is possible before the initialization only; reset first"
#define BEGIN "no initialization has begun"

typedef struct {
  double parameters[MODEL_PARAMETERS + 1];
  double memory[MODEL_MEMORY];
  double began, time; /* s */
  long long periods;  /* control periods that are complete */
  int state;
} Model;

typedef struct {
  Model model;
  char name[128];
  void *environment;
  void *log;
} Instance;

/* Everything as it was when the model was built. */
static void model_reset(Model *m) {
  memcpy(m->parameters, model_default_parameters, sizeof m->parameters);
  model_start(m->memory);
  m->began = m->time = 0.0;
  m->periods = 0;
  m->state = SETTING_UP;
}

/* The parameters count from here on. */
static void model_begin(Model *m) {
  model_derive(m->parameters, m->memory);
  m->state = RUNNING;
}

/* Where variable k is, or NULL: variable 0 is the time, then come parameters, then places in memory. */
static double *model_variable(Model *m, unsigned k) {
  if (k == 0) return &m->time;
  if (k <= MODEL_PARAMETERS) return &m->parameters[k - 1];
  return k < MODEL_VARIABLES ? &m->memory[model_place[k - 1 - MODEL_PARAMETERS]] : NULL;
}

/* Whether parameter or input k, counted from 0, may have this value: any where its limits are no numbers, as of a sensor's
   sample, which may be missing. */
static int model_takes(int k, double value) {
  return isnan(model_least[k]) || (isfinite(value) && value >= model_least[k] && value <= model_most[k]);
}

/* NULL, or why variable k must not become value now. */
static const char *model_refusal(const Model *m, unsigned k, double value) {
  if (k == 0 || k >= MODEL_VARIABLES || k > MODEL_PARAMETERS + MODEL_INPUTS) return "only parameters and inputs can be set";
  if (m->state == OVER) return "the simulation is over; reset it first";
  if (k <= MODEL_PARAMETERS && m->state >= RUNNING) return "parameters can be set before the simulation begins";
  if (!model_takes((int)k - 1, value)) return "the value is outside of its limits";
  return NULL;
}

/* NULL, or why m, read from bytes, is no state of this model. By words that no step changes code jumps and indexes. */
static const char *model_damage(const Model *m) {
  int32_t at = 0, ranges = (int32_t)(sizeof model_changing / sizeof *model_changing);
  for (int k = 0; k <= ranges; k++) {
    int32_t next = k < ranges ? model_changing[k][0] : MODEL_MEMORY;
    size_t constant = sizeof(double) * (size_t)(next - at);
    if (memcmp(m->memory + at, birthsim_image + at, constant)) return "the bytes are of another model, or damaged";
    at = k < ranges ? model_changing[k][1] : at;
  }
  if (m->state < SETTING_UP || m->state > OVER || m->periods < 0 || !isfinite(m->began) || !isfinite(m->time))
    return "the bytes are damaged: there is no such time or state";
  for (int k = 0; k < MODEL_PARAMETERS + MODEL_INPUTS; k++) {
    double value = k < MODEL_PARAMETERS ? m->parameters[k] : m->memory[model_place[k - MODEL_PARAMETERS]];
    if (!model_takes(k, value)) return "the bytes are damaged: a value is outside of its limits";
  }
  return NULL;
}

/* Whole control periods up to now + step, s; NULL, or why not. After a refusal the simulation is over. */
static const char *model_advance(Model *m, double now, double step) {
  double due = (now + step - m->began) / MODEL_PERIOD;
  if (m->state != RUNNING) return "a step is possible after initialization and before the end";
  m->state = OVER;
  if (!(fabs(now - m->time) <= 0.01 * MODEL_PERIOD)) return "a step must begin where the last one ended";
  if (!(step >= 0.0) || !(due - (double)m->periods < 1e9)) return "the communication step must be a finite number from 0 on, s";
  /* Times come in as sums of steps: a period that lacks a thousandth is complete. */
  long long count = (long long)floor(due + 1e-3) - m->periods;
  if (count > 0) {
    int missed = model_run(m->memory, (int32_t)count);
    m->periods += count;
    if (missed) return "the law cannot serve these setpoints: the stiffness must be positive definite";
  }
  m->time = now + step;
  for (int k = 0; k < MODEL_OUTPUTS; k++)
    if (!isfinite(m->memory[model_place[MODEL_INPUTS + k]])) return "a state is not finite any more";
  m->state = RUNNING;
  return NULL;
}

#endif
