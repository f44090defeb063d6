/* A wall clock before 1970, while the file $RMF_BRIDGES_PAST is there. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <stdlib.h>
#include <time.h>
#include <unistd.h>

int clock_gettime(clockid_t clock, struct timespec *at)
{
    static int (*real)(clockid_t, struct timespec *);
    if (!real)
        real = dlsym(RTLD_NEXT, "clock_gettime");
    int result = real(clock, at);
    const char *past = getenv("RMF_BRIDGES_PAST");
    if (!result && clock == CLOCK_REALTIME && past && access(past, F_OK) == 0)
        at->tv_sec -= 4000000000LL;
    return result;
}
