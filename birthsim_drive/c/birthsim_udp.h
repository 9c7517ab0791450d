/* Packets between a rig and `birthsim drive --driver udp:HOST:PORT`, for the program on the rig; birthsim_drive/packet.py says what
 * stands where. C99, no allocation, any byte order. rig.c is an example.
 *
 * In every control period the rig sends a sample and applies the openings that answer it. Two duties are its own, because a
 * computer cannot fulfil them for it: to close the valves where no command has come for some 20 ms, and to cut off what leaves
 * the limits of the hardware.
 */
#ifndef BIRTHSIM_UDP_H
#define BIRTHSIM_UDP_H

#include <stddef.h>
#include <stdint.h>
#include <string.h>

enum {
  BIRTHSIM_UDP_VERSION = 1,
  BIRTHSIM_UDP_SAMPLE = 1, /* kinds */
  BIRTHSIM_UDP_COMMAND = 2,
  BIRTHSIM_UDP_SAMPLE_SIZE = 156, /* bytes */
  BIRTHSIM_UDP_COMMAND_SIZE = 60,
  BIRTHSIM_UDP_SAMPLED = 1, /* flags of a sample: positions are samples of a tracker or an encoder */
  BIRTHSIM_UDP_ACCELERATION = 2, /* there is an acceleration */
  BIRTHSIM_UDP_FORCE = 4, /* there is a force of the hand */
  BIRTHSIM_UDP_ENCODERS = 8, /* positions are of encoders */
  BIRTHSIM_UDP_CLOSED = 16, /* the rig's watchdog has closed the valves */
  BIRTHSIM_UDP_GOES_ON = 0, /* states of a command */
  BIRTHSIM_UDP_STOPS = 1 /* the rig may close the valves and forget the sender */
};

/* What the sensors of a rig say, SI units; 0 where there is no such sensor, NaN where one fails. */
typedef struct {
  uint64_t counter; /* from 1 on */
  double time;
  double position[2], position_time, velocity[2], acceleration[2];
  double pressure[4]; /* absolute, of chambers P1, N1, P2, N2 */
  double force[2]; /* of the hand */
  uint64_t answered; /* counter of the sample whose command was applied last, in time */
  uint32_t missed; /* samples that no command answered in time */
  uint32_t flags;
} birthsim_sample;

typedef struct {
  uint64_t answers; /* counter of the sample that it answers; 0 asks for samples */
  double opening[4]; /* of the valves of chambers P1, N1, P2, N2, -1 to 1 */
  uint32_t state;
} birthsim_command;

static inline void birthsim_udp_put(uint8_t *at, uint64_t value, int bytes) {
  for (int k = 0; k < bytes; k++) at[k] = (uint8_t)(value >> (8 * k));
}

static inline uint64_t birthsim_udp_get(const uint8_t *at, int bytes) {
  uint64_t value = 0;
  for (int k = 0; k < bytes; k++) value |= (uint64_t)at[k] << (8 * k);
  return value;
}

static inline void birthsim_udp_put_double(uint8_t *at, double value) {
  uint64_t bits;
  memcpy(&bits, &value, sizeof bits);
  birthsim_udp_put(at, bits, 8);
}

static inline double birthsim_udp_get_double(const uint8_t *at) {
  uint64_t bits = birthsim_udp_get(at, 8);
  double value;
  memcpy(&value, &bits, sizeof value);
  return value;
}

/* CRC-32 as zlib, PNG and Ethernet have it. */
static inline uint32_t birthsim_udp_crc(const uint8_t *bytes, size_t count) {
  uint32_t crc = 0xffffffffu;
  for (size_t k = 0; k < count; k++) {
    crc ^= bytes[k];
    for (int bit = 0; bit < 8; bit++) crc = (crc >> 1) ^ (0xedb88320u & (0u - (crc & 1u)));
  }
  return ~crc;
}

static inline void birthsim_udp_head(uint8_t *bytes, int kind, uint64_t counter) {
  memcpy(bytes, "BSIM", 4);
  birthsim_udp_put(bytes + 4, BIRTHSIM_UDP_VERSION, 2);
  birthsim_udp_put(bytes + 6, (uint64_t)kind, 2);
  birthsim_udp_put(bytes + 8, counter, 8);
}

/* Whether bytes are a whole packet of a kind. */
static inline int birthsim_udp_is(const uint8_t *bytes, size_t count, size_t size, int kind) {
  return count == size && !memcmp(bytes, "BSIM", 4) && birthsim_udp_get(bytes + 4, 2) == BIRTHSIM_UDP_VERSION &&
         birthsim_udp_get(bytes + 6, 2) == (uint64_t)kind && birthsim_udp_get(bytes + size - 4, 4) == birthsim_udp_crc(bytes, size - 4);
}

/* Write a sample as BIRTHSIM_UDP_SAMPLE_SIZE bytes. */
static inline void birthsim_udp_pack_sample(const birthsim_sample *s, uint8_t *bytes) {
  const double signals[14] = {
      s->time,         s->position[0],     s->position[1],     s->position_time, s->velocity[0], s->velocity[1], s->acceleration[0],
      s->acceleration[1], s->pressure[0],  s->pressure[1],     s->pressure[2],   s->pressure[3], s->force[0],    s->force[1]};
  birthsim_udp_head(bytes, BIRTHSIM_UDP_SAMPLE, s->counter);
  for (int k = 0; k < 14; k++) birthsim_udp_put_double(bytes + 16 + 8 * k, signals[k]);
  birthsim_udp_put(bytes + 128, s->answered, 8);
  birthsim_udp_put(bytes + 136, s->missed, 4);
  birthsim_udp_put(bytes + 140, s->flags, 4);
  birthsim_udp_put(bytes + 144, 0, 8);
  birthsim_udp_put(bytes + 152, birthsim_udp_crc(bytes, 152), 4);
}

/* Read a command; returns 0, and leaves it, where the bytes are none. */
static inline int birthsim_udp_read_command(const uint8_t *bytes, size_t count, birthsim_command *c) {
  if (!birthsim_udp_is(bytes, count, BIRTHSIM_UDP_COMMAND_SIZE, BIRTHSIM_UDP_COMMAND)) return 0;
  c->answers = birthsim_udp_get(bytes + 8, 8);
  for (int k = 0; k < 4; k++) c->opening[k] = birthsim_udp_get_double(bytes + 16 + 8 * k);
  c->state = (uint32_t)birthsim_udp_get(bytes + 48, 4);
  return 1;
}

#endif
