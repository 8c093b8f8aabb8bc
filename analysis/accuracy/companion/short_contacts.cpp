// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/accuracy/companion/short_contacts.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace lobatto {

namespace {

constexpr double graded_at_contacts = 2;      // as at pulses; more of other steps would change their energy
constexpr double notable_change = 64;         // times the usual one
constexpr double most_parts_on_trial = 1000;  // of a step: a contact that is shorter matters unseen
constexpr double shortest_rest = 1e-6;        // of a step: what is left after a cut
constexpr double undivided = 1.999;           // of a step: what is shorter is not in two parts yet

}  // namespace

bool ShortContacts::is_near(double from, double step) const {
    return is_divided_ && is_too_long(contacts_, graded_at_contacts, from, step);
}

void ShortContacts::begin(CompanionPlace& place, double from) const {
    place.cuts.set_step(request_.step);
    place.cuts.begin(from == request_.time ? from : std::numeric_limits<double>::infinity());
}

bool ShortContacts::is_met(CompanionPlace& place, const std::vector<double>& step) {
    if (!is_cut_) return false;
    if (looks_at_usual_ && !is_part(step.front()) && std::isinf(place.cuts.last())) {
        const std::vector<double> change = change_in_parts(place, step, 1, 2), here = place.rounded_row();
        usual_change_.resize(change.size());
        for (std::size_t i = 0; i < change.size(); ++i)
            usual_change_[i] =
                std::fmax(usual_change_[i], std::fmax(change[i], place.stepper.kernel()->epsilon * std::fabs(here[i])));
        looks_at_usual_ = false;
    }
    const std::optional<Pulse> contact = found(place, step);
    if (!contact || !matters(place, step, *contact)) return false;
    insert_in_order(contacts_, *contact);
    return true;
}

// Between two cuts that are nearer to one another than two steps of the run; the first of them is in the last step, or
// the start of the run. The steps after it are taken on trial; the end of the run counts as a cut.
std::optional<Pulse> ShortContacts::found(CompanionPlace& place, const std::vector<double>& step) const {
    const double first = place.cuts.last();
    if (!is_divided_ || !std::isfinite(first)) return std::nullopt;
    const double longest = NearCuts::near * std::fabs(request_.step), size = std::fabs(step.front()),
                 end = time_after(request_, request_.steps);
    const CompanionPlace::State after = place.state();
    while (place.cuts.last() == first && place.status == LOBATTO_OK &&
           std::fabs(place.time.front() - first) <= longest) {
        if (std::fabs(end - place.time.front()) < size / 2)
            place.cuts.observe(end);
        else
            place.advance(1, request_.tolerance);
    }
    const double gap = place.cuts.gap(), middle = place.cuts.middle();
    place.go_back(after);
    if (!(gap < longest && gap < undivided * whole_step_)) return std::nullopt;
    return Pulse{middle, gap};
}

// Whether parts of a contact lead elsewhere by much more than halves of steps do that nothing cuts. Where they do not,
// whole steps are better: parts would only change the energy. Where steps are in parts for another contact, this one
// is, too.
bool ShortContacts::matters(CompanionPlace& place, const std::vector<double>& step, const Pulse& contact) const {
    if (usual_change_.empty() || is_part(step.front())) return true;
    const double size = std::fabs(step.front()), parts = std::ceil(2 * size / contact.width),
                 to_its_end = std::fabs(contact.time - place.before.time.front()) + contact.width / 2;
    if (!(parts <= most_parts_on_trial)) return true;
    return is_notable(
        change_in_parts(place, step, 1 + static_cast<int>(std::ceil(to_its_end / size)), static_cast<int>(parts) + 1));
}

bool ShortContacts::is_notable(const std::vector<double>& change) const {
    for (std::size_t i = 0; i < change.size(); ++i)
        if (usual_change_.empty() || !(change[i] <= notable_change * usual_change_[i])) return true;
    return false;
}

void ShortContacts::divide_rest(CompanionPlace& place, const std::vector<double>& step) const {
    const double from = place.before.time.front(), cut = place.cuts.last(), way = cut - from,
                 first = way + (step.front() - way) / 2;
    if (!is_sought() || !std::isfinite(cut) ||
        !(std::fabs(step.front() - way) > shortest_rest * std::fabs(step.front())))
        return;
    const CompanionPlace::State whole = place.state();
    const std::vector<double> there = place.rounded_row();
    place.go_back(place.before);
    for (const std::vector<double>& part : {as_parts({first}, place.stepper.parts()), minus(step, first)}) {
        place.set_step(part, request_.whole_parameters);
        place.advance(1, request_.tolerance);
    }
    std::vector<double> change = place.rounded_row();
    for (std::size_t i = 0; i < change.size(); ++i) change[i] = std::fabs(change[i] - there[i]);
    if (place.status != LOBATTO_OK || !is_notable(change)) place.go_back(whole);
}

// What it changes in q and p to take so many steps from place.before, each in so many parts.
std::vector<double> ShortContacts::change_in_parts(CompanionPlace& place, const std::vector<double>& step, int steps,
                                                   int parts) const {
    const CompanionPlace::State after = place.state();
    bool has_both = true;
    const auto lead_to = [&](int count, const std::vector<double>& size) {
        place.go_back(place.before);
        place.set_step(size, request_.whole_parameters);
        place.advance(count, request_.tolerance);
        has_both = has_both && place.status == LOBATTO_OK;
        return place.rounded_row();
    };
    const std::vector<double> whole = lead_to(steps, step);
    std::vector<double> change = lead_to(steps * parts, times_fraction(step, 1, parts));
    place.go_back(after);
    for (std::size_t i = 0; i < change.size(); ++i)
        change[i] = has_both ? std::fabs(change[i] - whole[i]) : std::numeric_limits<double>::infinity();
    return change;
}

}  // namespace lobatto
