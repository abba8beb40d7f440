// The C interface of an installed Carom, linked as C.

#include <stdio.h>

#include <carom/carom.h>

int main(void) {
  printf("C interface %ld\n", (long)carom_version());
  return 0;
}
