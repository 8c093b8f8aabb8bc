// SPDX-License-Identifier: GPL-2.0-or-later
// Which variables formulas hold, and values put into them.
#pragma once

#include <ginac/ginac.h>

#include <map>
#include <set>
#include <vector>

namespace lobatto {

// The variables that an expression holds, as indices in ascending order.
class Occurrences {
public:
    explicit Occurrences(const std::vector<GiNaC::symbol>& variables) {
        for (std::size_t i = 0; i < variables.size(); ++i) index_[variables[i]] = i;
    }
    std::set<std::size_t> in(const GiNaC::ex& expression) const {
        std::set<std::size_t> found;
        visit(expression, found);
        return found;
    }

private:
    void visit(const GiNaC::ex& expression, std::set<std::size_t>& found) const {
        if (GiNaC::is_a<GiNaC::symbol>(expression)) {
            if (const auto known = index_.find(expression); known != index_.end()) found.insert(known->second);
            return;
        }
        for (std::size_t i = 0; i < expression.nops(); ++i) visit(expression.op(i), found);
    }
    std::map<GiNaC::ex, std::size_t, GiNaC::ex_is_less> index_;
};

// GiNaC goes through the whole of a substitution at every sum and product: only what occurs is put into it.
GiNaC::ex at(const GiNaC::ex& expression, const std::vector<GiNaC::symbol>& variables, const Occurrences& occurrences,
             const GiNaC::ex& value);
// A value that does not depend on what its formula mentions, without it: at the origin, or where that is a pole, beside
// it.
GiNaC::ex without(const GiNaC::ex& value, const std::vector<GiNaC::symbol>& mentioned, const Occurrences& occurrences);

}  // namespace lobatto
