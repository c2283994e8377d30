/* Preloaded, a CAN interface "can9" whose sockets are at their end: what an interface that has gone leaves
   behind, for a program on a kernel without CAN. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <linux/can.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <stdarg.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#define NEXT(name) ((__typeof__(&(name)))dlsym(RTLD_NEXT, #name))

int socket(int domain, int type, int protocol) {
  if (domain != PF_CAN) return NEXT(socket)(domain, type, protocol);
  int ends[2];
  if (socketpair(AF_UNIX, SOCK_SEQPACKET | (type & (SOCK_CLOEXEC | SOCK_NONBLOCK)), 0, ends) != 0) return -1;
  close(ends[1]);
  return ends[0];
}

unsigned if_nametoindex(const char* name) {
  return strcmp(name, "can9") == 0 ? 9 : NEXT(if_nametoindex)(name);
}

int bind(int number, const struct sockaddr* address, socklen_t size) {
  return address->sa_family == AF_CAN ? 0 : NEXT(bind)(number, address, size);
}

int setsockopt(int number, int level, int option, const void* value, socklen_t size) {
  return level == SOL_CAN_RAW ? 0 : NEXT(setsockopt)(number, level, option, value, size);
}

int ioctl(int number, unsigned long request, ...) {
  va_list rest;
  va_start(rest, request);
  void* argument = va_arg(rest, void*);
  va_end(rest);
  if (request == SIOCGIFFLAGS) return ((struct ifreq*)argument)->ifr_flags = IFF_UP, 0;
  return NEXT(ioctl)(number, request, argument);
}
