/* SPDX-License-Identifier: Apache-2.0 */
/* Prints the commanded force (newtons, world frame) 20 times a second, as an example of a client: cc -o forces forces.c
   Its socket is that of HAPTICD_SOCKET, or the status socket of the service. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

int main(void) {
  const char* named = getenv("HAPTICD_SOCKET");
  struct sockaddr_un box = {.sun_family = AF_UNIX};
  strncpy(box.sun_path, named && *named ? named : "/run/hapticd/io.hapticd.Status", sizeof box.sun_path - 1);
  const char call[] = "{\"method\": \"io.hapticd.Status.Ticks\", \"more\": true,"
                      " \"parameters\": {\"fields\": [\"command_force_n_in_world\"]}}";
  const int link = socket(AF_UNIX, SOCK_STREAM, 0);
  if (connect(link, (struct sockaddr*)&box, sizeof box) != 0) return perror(box.sun_path), 1;  /* is hapticd running? */
  if (write(link, call, sizeof call) != sizeof call) return 1;  /* with the zero byte at its end */
  FILE* replies = fdopen(link, "r");
  char* reply = NULL;
  size_t size = 0;
  for (double x, y, z; getdelim(&reply, &size, 0, replies) > 0;) {
    const char* newest = strrchr(reply, '[');  /* the last vector of the list */
    if (newest && sscanf(newest, "[%lf,%lf,%lf]", &x, &y, &z) == 3) printf("%.3f %.3f %.3f\n", x, y, z), fflush(stdout);
  }
  return 1;  /* the daemon has closed the connection */
}
