/* SPDX-License-Identifier: Apache-2.0
 * Small FMUs for tests, FMI 2 and 3, model exchange and co-simulation; the headers are fmpy's, found when it is compiled.
 *
 *   -DFMI=2 | 3     version
 *   -DBALL          a ball that bounces (an event at x = 0), else the frame of examples/frame
 *   -DFAILS         its rates fail once the first state is beyond 1
 */
#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#if FMI == 2
#include "fmi2Functions.h"
#else
#include "fmi3Functions.h"
#endif

#define NX 2
enum { X, V, DX, DV, MASS, DAMPING, STIFFNESS, BASE, BASE_SPEED, TO_GROUND, TO_BASE, BOUNCE, SWING, COUNT };

typedef struct {
  double v[COUNT], t;
  int bounced;
} Model;

static void zeroed(Model *m) {
  memset(m, 0, sizeof *m);
  m->v[MASS] = 3.0, m->v[DAMPING] = 0.5, m->v[STIFFNESS] = 1000.0, m->v[BOUNCE] = 0.8;
#ifdef BALL
  m->v[X] = 1.0;
#endif
}

static int rates(Model *m) {
  double *v = m->v;
  v[DX] = v[V];
#ifdef BALL
  v[DV] = -9.81 + v[TO_GROUND] / v[MASS];
#else
  v[DV] = (v[TO_GROUND] + v[TO_BASE] - v[STIFFNESS] * (v[X] - v[BASE]) - v[DAMPING] * (v[V] - v[BASE_SPEED])) / v[MASS];
#endif
  v[SWING] = v[X] - v[BASE];
#ifdef FAILS
  return fabs(v[X]) > 1.0;
#else
  return 0;
#endif
}

static int get(Model *m, const unsigned *vr, size_t n, double *out) {
  int bad = rates(m);
  for (size_t i = 0; i < n; i++) {
    if (vr[i] >= COUNT) return 1;
    out[i] = m->v[vr[i]];
  }
  return bad;
}

static int set(Model *m, const unsigned *vr, size_t n, const double *in) {
  for (size_t i = 0; i < n; i++) {
    if (vr[i] >= COUNT) return 1;
    m->v[vr[i]] = in[i];
  }
  return 0;
}

static bool bounces(Model *m) {
#ifdef BALL
  return m->v[X] < 0.0 && m->v[V] < 0.0;
#else
  (void)m;
  return false;
#endif
}

static bool settled(Model *m) {
  if (!bounces(m)) return false;
  m->v[X] = 0.0, m->v[V] = -m->v[BOUNCE] * m->v[V];
  return true;
}

static int stepped(Model *m, double h) { /* sixteen midpoint steps: finer than any test looks */
  for (int k = 0; k < 16; k++) {
    double x = m->v[X], v = m->v[V], d = h / 16.0;
    if (rates(m)) return 1;
    m->v[X] = x + 0.5 * d * m->v[DX], m->v[V] = v + 0.5 * d * m->v[DV];
    if (rates(m)) return 1;
    m->v[X] = x + d * m->v[DX], m->v[V] = v + d * m->v[DV];
    settled(m);
  }
  m->t += h;
  return 0;
}

#if FMI == 2
#define OF(c) ((Model *)(c))
#define STATUS(bad) ((bad) ? fmi2Error : fmi2OK)
fmi2Component fmi2Instantiate(fmi2String n, fmi2Type t, fmi2String g, fmi2String r, const fmi2CallbackFunctions *f, fmi2Boolean v, fmi2Boolean l) {
  (void)n, (void)t, (void)r, (void)f, (void)v, (void)l;
  if (strcmp(g, "{frame}")) return NULL;
  Model *m = malloc(sizeof *m);
  zeroed(m);
  return m;
}
void fmi2FreeInstance(fmi2Component c) { free(c); }
fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean a, fmi2Real b, fmi2Real t, fmi2Boolean d, fmi2Real e) {
  (void)a, (void)b, (void)d, (void)e;
  OF(c)->t = t;
  return fmi2OK;
}
fmi2Status fmi2EnterInitializationMode(fmi2Component c) { (void)c; return fmi2OK; }
fmi2Status fmi2ExitInitializationMode(fmi2Component c) { (void)c; return fmi2OK; }
fmi2Status fmi2Reset(fmi2Component c) { zeroed(OF(c)); return fmi2OK; }
fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference *vr, size_t n, fmi2Real *v) { return STATUS(get(OF(c), vr, n, v)); }
fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference *vr, size_t n, const fmi2Real *v) { return STATUS(set(OF(c), vr, n, v)); }
fmi2Status fmi2EnterEventMode(fmi2Component c) { (void)c; return fmi2OK; }
fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo *e) {
  memset(e, 0, sizeof *e);
  e->valuesOfContinuousStatesChanged = settled(OF(c));
  return fmi2OK;
}
fmi2Status fmi2EnterContinuousTimeMode(fmi2Component c) { (void)c; return fmi2OK; }
fmi2Status fmi2CompletedIntegratorStep(fmi2Component c, fmi2Boolean n, fmi2Boolean *e, fmi2Boolean *t) {
  (void)c, (void)n;
  *e = *t = fmi2False;
  return fmi2OK;
}
fmi2Status fmi2SetTime(fmi2Component c, fmi2Real t) { OF(c)->t = t; return fmi2OK; }
fmi2Status fmi2SetContinuousStates(fmi2Component c, const fmi2Real *x, size_t n) { memcpy(OF(c)->v, x, n * sizeof *x); return fmi2OK; }
fmi2Status fmi2GetContinuousStates(fmi2Component c, fmi2Real *x, size_t n) { memcpy(x, OF(c)->v, n * sizeof *x); return fmi2OK; }
fmi2Status fmi2GetDerivatives(fmi2Component c, fmi2Real *x, size_t n) {
  int bad = rates(OF(c));
  memcpy(x, OF(c)->v + DX, n * sizeof *x);
  return STATUS(bad);
}
fmi2Status fmi2GetEventIndicators(fmi2Component c, fmi2Real *z, size_t n) { for (size_t i = 0; i < n; i++) z[i] = OF(c)->v[X]; return fmi2OK; }
fmi2Status fmi2DoStep(fmi2Component c, fmi2Real t, fmi2Real h, fmi2Boolean n) {
  (void)t, (void)n;
  return STATUS(stepped(OF(c), h));
}
#else
#define OF(c) ((Model *)(c))
#define STATUS(bad) ((bad) ? fmi3Error : fmi3OK)
static fmi3Instance made(fmi3String token) {
  if (strcmp(token, "{frame}")) return NULL;
  Model *m = malloc(sizeof *m);
  zeroed(m);
  return m;
}
fmi3Instance fmi3InstantiateModelExchange(fmi3String n, fmi3String g, fmi3String r, fmi3Boolean v, fmi3Boolean l, fmi3InstanceEnvironment e, fmi3LogMessageCallback m) {
  (void)n, (void)r, (void)v, (void)l, (void)e, (void)m;
  return made(g);
}
fmi3Instance fmi3InstantiateCoSimulation(fmi3String n, fmi3String g, fmi3String r, fmi3Boolean v, fmi3Boolean l, fmi3Boolean a, fmi3Boolean b, const fmi3ValueReference q[], size_t nq, fmi3InstanceEnvironment e, fmi3LogMessageCallback m, fmi3IntermediateUpdateCallback i) {
  (void)n, (void)r, (void)v, (void)l, (void)a, (void)b, (void)q, (void)nq, (void)e, (void)m, (void)i;
  return made(g);
}
void fmi3FreeInstance(fmi3Instance c) { free(c); }
fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean a, fmi3Float64 b, fmi3Float64 t, fmi3Boolean d, fmi3Float64 e) {
  (void)a, (void)b, (void)d, (void)e;
  OF(c)->t = t;
  return fmi3OK;
}
fmi3Status fmi3ExitInitializationMode(fmi3Instance c) { (void)c; return fmi3OK; }
fmi3Status fmi3Reset(fmi3Instance c) { zeroed(OF(c)); return fmi3OK; }
fmi3Status fmi3GetFloat64(fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3Float64 v[], size_t nv) { return STATUS(n != nv || get(OF(c), vr, n, v)); }
fmi3Status fmi3SetFloat64(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3Float64 v[], size_t nv) { return STATUS(n != nv || set(OF(c), vr, n, v)); }
fmi3Status fmi3EnterEventMode(fmi3Instance c) { (void)c; return fmi3OK; }
fmi3Status fmi3UpdateDiscreteStates(fmi3Instance c, fmi3Boolean *a, fmi3Boolean *b, fmi3Boolean *n, fmi3Boolean *v, fmi3Boolean *d, fmi3Float64 *t) {
  *a = *b = *n = *d = false, *t = 0.0;
  *v = settled(OF(c));
  return fmi3OK;
}
fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance c) { (void)c; return fmi3OK; }
fmi3Status fmi3CompletedIntegratorStep(fmi3Instance c, fmi3Boolean n, fmi3Boolean *e, fmi3Boolean *t) {
  (void)c, (void)n;
  *e = *t = false;
  return fmi3OK;
}
fmi3Status fmi3SetTime(fmi3Instance c, fmi3Float64 t) { OF(c)->t = t; return fmi3OK; }
fmi3Status fmi3SetContinuousStates(fmi3Instance c, const fmi3Float64 x[], size_t n) { memcpy(OF(c)->v, x, n * sizeof *x); return fmi3OK; }
fmi3Status fmi3GetContinuousStates(fmi3Instance c, fmi3Float64 x[], size_t n) { memcpy(x, OF(c)->v, n * sizeof *x); return fmi3OK; }
fmi3Status fmi3GetContinuousStateDerivatives(fmi3Instance c, fmi3Float64 x[], size_t n) {
  int bad = rates(OF(c));
  memcpy(x, OF(c)->v + DX, n * sizeof *x);
  return STATUS(bad);
}
#ifdef BALL
fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance c, size_t *n) { (void)c; *n = 1; return fmi3OK; }
#else
fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance c, size_t *n) { (void)c; *n = 0; return fmi3OK; }
#endif
fmi3Status fmi3GetEventIndicators(fmi3Instance c, fmi3Float64 z[], size_t n) { for (size_t i = 0; i < n; i++) z[i] = OF(c)->v[X]; return fmi3OK; }
fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 t, fmi3Float64 h, fmi3Boolean n, fmi3Boolean *a, fmi3Boolean *b, fmi3Boolean *e, fmi3Float64 *l) {
  (void)t, (void)n;
  *a = *b = *e = false, *l = t + h;
  return STATUS(stepped(OF(c), h));
}
#endif
