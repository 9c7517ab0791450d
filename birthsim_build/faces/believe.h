
/* Parameters of a rig that a controller may be told, SI units, by their names in a rig's file. */
enum birthsim_parameter {
@PARAMETERS@
  BIRTHSIM_RIG_PARAMETERS = @COUNT@
};

/* Words of a loop at which the belief of its controller begins. */
@PLACES@

/* Write the parameters of the rig for which this was exported. */
static inline void birthsim_rig(double *p) {
  static const double own[] = {@OWN@};
  memcpy(p, own, sizeof own);
}

/* Tell a controller a rig, at any time between control periods; `belief` is the word of this loop named above. It goes over to
 * that rig within some 50 ms, so that no valve jumps. Sensors, linkage and options stay those of the export. The numbers must
 * be those of a rig that could exist: birthsim explain checks a rig's file. */
static inline void birthsim_believe(birthsim_word *loop, int belief, const double *p) {
  const double told[] = {
@TOLD@
  };
  for (int k = 0; k < @RIG@; k++) loop[belief + k].number = told[k];
  loop[belief + @NEWS@].number = 1.0;
}
