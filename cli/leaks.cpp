// SPDX-License-Identifier: GPL-2.0-or-later
// The leaks that are not ours. Linked into every program; only the leak sanitiser ever calls these.

// NOLINTBEGIN(bugprone-reserved-identifier): the names are the sanitiser's.
extern "C" const char* __lsan_default_suppressions();
extern "C" const char* __lsan_default_options();
// NOLINTEND(bugprone-reserved-identifier)

// CLN never frees the tables it sets up before main (26 bytes in Debian 12's 1.3.6).
extern "C" const char* __lsan_default_suppressions() {
    return "leak:libcln.so\n";
}

// Programs' messages are tested word for word; a list of the suppressions used would stand among them.
extern "C" const char* __lsan_default_options() {
    return "print_suppressions=0";
}
