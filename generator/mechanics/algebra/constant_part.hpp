// SPDX-License-Identifier: GPL-2.0-or-later
// The additive part of a second derivative that does not depend on some variables.
#pragma once

#include <ginac/ginac.h>

#include <set>
#include <vector>

namespace lobatto {

class ConstantPart {
public:
    explicit ConstantPart(const std::vector<GiNaC::symbol>& variables);
    GiNaC::ex of(const GiNaC::ex& value) const;

private:
    bool holds_variable(const GiNaC::ex& value) const;
    std::set<GiNaC::ex, GiNaC::ex_is_less> variables_;
};

}  // namespace lobatto
