/* What this is the version of: the program, and what it speaks (2401h). */
#ifndef ARB_VERSION_H
#define ARB_VERSION_H

enum {
    ARB_VERSION_MAJOR = 0, /* as in CMakeLists.txt */
    ARB_VERSION_MINOR = 1,
    ARB_VERSION_PATCH = 0,
    ARB_VERSION_PROTOCOL = 1 /* of the host API: counts changes that a host has to know of */
};

#endif
