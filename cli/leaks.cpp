// SPDX-License-Identifier: GPL-2.0-or-later
// The leaks that are not ours. Linked into every program; only the leak sanitiser ever calls it.

extern "C" const char* __lsan_default_suppressions();

// CLN never frees the tables it sets up before main (26 bytes in Debian 12's 1.3.6).
extern "C" const char* __lsan_default_suppressions() { return "leak:libcln.so\n"; }
