#include "cli/commands.hpp"
namespace lobatto {
__attribute__((weak)) void add_derive(CLI::App&) {}
__attribute__((weak)) void add_emit(CLI::App&) {}
__attribute__((weak)) void add_verify(CLI::App&) {}
__attribute__((weak)) void add_paper(CLI::App&) {}
}  // namespace lobatto
