#pragma once

/// GONIO_WIDE: a function so marked is compiled once more for four doubles an instruction; which of
/// the two runs is chosen when the program starts. Both give the same bytes: no fused
/// multiplication (-ffp-contract=off), no sum in another order. Sanitizers cannot follow such a
/// choice, and Clang builds nothing here but them.
#if defined(__x86_64__) && defined(__linux__) && !defined(__SANITIZE_THREAD__) && \
    !defined(__SANITIZE_ADDRESS__) && !defined(__clang__)
#define GONIO_HAS_WIDE 1
#define GONIO_WIDE __attribute__((target_clones("avx2", "default")))
#else
#define GONIO_HAS_WIDE 0
#define GONIO_WIDE
#endif
