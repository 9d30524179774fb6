// Versions of a hot function for the processors of x86-64, chosen at load time; elsewhere the baseline alone.
#pragma once

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#define PBRDF_CLONES __attribute__((target_clones("default", "arch=x86-64-v3", "arch=x86-64-v4")))
#else
#define PBRDF_CLONES
#endif
