// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/proof/proof_row.hpp"

#include <fmt/format.h>

namespace lobatto {

namespace {

std::string number(double x) {
    return fmt::format("{:.2g}", x);
}

}  // namespace

ProofRow row_of(const Check& check) {
    return {check.claim, check.exact ? (check.holds ? "0" : "not 0") : number(check.measured),
            check.exact ? "exact" : number(check.bound), check.holds, check.meaning};
}

ProofRow at_most(const std::string& claim, double measured, double bound, const std::string& meaning) {
    return {claim, number(measured), number(bound), measured <= bound, meaning};
}

ProofRow not_decided(const std::string& claim, const std::string& why) {
    return {claim, "not decided", why, true, ""};
}

ProofRow not_promised(const std::string& claim, const std::string& why) {
    return {claim, "not promised", why, true, ""};
}

}  // namespace lobatto
