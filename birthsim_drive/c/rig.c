/* A rig that `birthsim drive --driver udp:127.0.0.1:5005` drives: the plant of `birthsim export --to c`, exact sensors, lockstep.
 *
 *     birthsim export --to c --out out/c
 *     cc -std=c99 -O2 -I out/c -I <this folder> rig.c out/c/libbirthsim.so -o rig -Wl,-rpath,out/c
 *     ./rig 5005
 *
 * On hardware `measure` reads converters, `open_valves` writes them, and a timer replaces the wait for an answer; the rest stays.
 */
#define _POSIX_C_SOURCE 200809L
#include <math.h>
#include <netinet/in.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include "birthsim.h"
#include "birthsim_udp.h"

enum { PATIENCE = 60 }; /* s without a command after which it ends */
#define PERIOD 0.001 /* s */

static birthsim_word plant[BIRTHSIM_PLANT_WORDS];

static void measure(birthsim_sample *s) {
  const int pressure[4] = {BIRTHSIM_PP1, BIRTHSIM_PN1, BIRTHSIM_PP2, BIRTHSIM_PN2};
  s->time = s->position_time = PERIOD * (double)(s->counter - 1);
  s->position[0] = birthsim_get(plant, BIRTHSIM_X), s->position[1] = birthsim_get(plant, BIRTHSIM_Y);
  s->velocity[0] = birthsim_get(plant, BIRTHSIM_VX), s->velocity[1] = birthsim_get(plant, BIRTHSIM_VY);
  for (int k = 0; k < 4; k++) s->pressure[k] = birthsim_get(plant, pressure[k]);
  s->flags = BIRTHSIM_UDP_FORCE; /* nobody touches it: 0 N */
}

static void open_valves(const double opening[4]) {
  for (int k = 0; k < 4; k++) birthsim_set(plant, BIRTHSIM_OPENING_P1 + k, opening[k]);
  birthsim_advance(plant, 1);
}

/* The next whole command and who sent it; 0 where none comes. */
static int take(int link, birthsim_command *c, struct sockaddr_in *from) {
  uint8_t bytes[2 * BIRTHSIM_UDP_COMMAND_SIZE];
  for (;;) {
    socklen_t size = sizeof *from;
    ssize_t count = recvfrom(link, bytes, sizeof bytes, 0, (struct sockaddr *)from, &size);
    if (count < 0) return 0;
    if (birthsim_udp_read_command(bytes, (size_t)count, c)) return 1;
  }
}

int main(int count, char **words) {
  struct sockaddr_in own = {0}, peer, from;
  struct timeval patience = {PATIENCE, 0};
  birthsim_sample sample = {0};
  birthsim_command command;
  int link = socket(AF_INET, SOCK_DGRAM, 0);
  own.sin_family = AF_INET, own.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  own.sin_port = htons((uint16_t)(count > 1 ? atoi(words[1]) : 5005));
  if (link < 0 || bind(link, (struct sockaddr *)&own, sizeof own)) return perror("rig"), 1;
  setsockopt(link, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  birthsim_begin(plant, birthsim_plant, BIRTHSIM_PLANT_WORDS);
  printf("listening\n"), fflush(stdout);
  if (!take(link, &command, &peer)) return fprintf(stderr, "rig: nobody asked for samples\n"), 1;
  for (;;) {
    uint8_t bytes[BIRTHSIM_UDP_SAMPLE_SIZE];
    sample.counter++;
    measure(&sample);
    birthsim_udp_pack_sample(&sample, bytes);
    sendto(link, bytes, sizeof bytes, 0, (struct sockaddr *)&peer, sizeof peer);
    do {
      if (!take(link, &command, &from)) return fprintf(stderr, "rig: no command came\n"), 1;
    } while (command.state != BIRTHSIM_UDP_STOPS && command.answers != sample.counter);
    if (command.state == BIRTHSIM_UDP_STOPS) break;
    sample.answered = sample.counter;
    open_valves(command.opening);
  }
  printf("%.17g %.17g\n", birthsim_get(plant, BIRTHSIM_X), birthsim_get(plant, BIRTHSIM_Y));
  return 0;
}
