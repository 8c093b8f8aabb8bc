// SPDX-License-Identifier: GPL-2.0-or-later
// What the sanitisers are to know: the leaks that are not ours, and what takes time. Linked into every program; only
// they ever call these.

// NOLINTBEGIN(bugprone-reserved-identifier): the names are the sanitiser's.
extern "C" const char* __lsan_default_suppressions();
extern "C" const char* __lsan_default_options();
extern "C" const char* __asan_default_options();
// NOLINTEND(bugprone-reserved-identifier)

// CLN never frees the tables it sets up before main (26 bytes in Debian 12's 1.3.6). GiNaC (1.8.6) loses what it is
// making when a number put into it has a pole there: the constructor that throws leaves it behind. Of which function
// that is said depends on how far back the stack could be followed, so the library is named; what we lose of our own is
// still ours.
extern "C" const char* __lsan_default_suppressions() {
    return "leak:libcln.so\nleak:libginac.so\n";
}

// Programs' messages are tested word for word; a list of the suppressions used would stand among them.
extern "C" const char* __lsan_default_options() {
    return "print_suppressions=0";
}

// Where memory was taken is noted with so many callers; following all of them takes a fifth of the tests' time.
extern "C" const char* __asan_default_options() {
    return "malloc_context_size=6";
}
