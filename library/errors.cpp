// SPDX-License-Identifier: GPL-2.0-or-later
#include "library/errors.hpp"

#include <new>
#include <string>
#include <system_error>

#include "generator/formula/text/source.hpp"
#include "runtime/error.hpp"

namespace lobatto::api {

void rethrow() {
    try {
        throw;
    } catch (const Error&) {
        throw;
    } catch (const ThrownByCaller& thrown) {
        std::rethrow_exception(thrown.what);
    } catch (const lobatto::InputError& error) {
        throw InputError(error.what());
    } catch (const lobatto::ComputationError& error) {
        throw ComputationError(error.what());
    } catch (const lobatto::MachineError& error) {
        throw MachineError(error.what());
    } catch (const std::system_error& error) {
        throw MachineError(error.what());
    } catch (const std::bad_alloc&) {
        throw MachineError(
            "out of memory; states that are kept take most of it: keep fewer (every), or take fewer trajectories");
    } catch (const std::exception& error) {
        throw MachineError(std::string("internal error: ") + error.what() +
                           "\nThis is a mistake in Lobatto " LOBATTO_VERSION
                           ", not in your scene. Please report it with the version, the scene and what was asked for.");
    }
}

}  // namespace lobatto::api
