// SPDX-License-Identifier: GPL-2.0-or-later
// Random mechanisms of rigid bodies in a plane, and the same systems by hand, in angles.
#pragma once

#include "tests/fuzz/mechanism_charts.hpp"

namespace lobatto::test {

// Of mechanisms of bodies.
inline const std::vector<Range>& body_ranges() {
    static const std::vector<Range> all{
        {"m1", 0.5, 2},     {"m2", 0.5, 2},   {"m3", 0.5, 2},   {"J1", 0.6, 0.9}, {"J2", 0.6, 0.9},  {"J3", 0.6, 0.9},
        {"I1", 0.3, 0.5},   {"I2", 0.3, 0.5}, {"I3", 0.3, 0.5}, {"g", 0.5, 5},    {"kappa", 0.5, 5}, {"e", 0.1, 0.4},
        {"c1", 0.2, 0.8},   {"c2", 0.2, 0.8}, {"c3", 0.2, 0.8}, {"d1", 0.5, 1},   {"d2", 0.5, 1},    {"d3", 0.5, 1},
        {"b1", -0.5, -0.1}, {"b2", 0.1, 0.5}, {"b3", 0.2, 0.6}};
    return all;
}

inline Mechanism finished(const std::string& kind, const std::string& constrained, const std::string& minimal,
                          std::vector<Range> ranges, bool conserves = true) {
    Mechanism made{kind, constrained, minimal, std::move(ranges), conserves};
    for (const Range& range : body_ranges()) made.ranges.push_back(range);
    return made;
}

class PlaneAuthor {
public:
    explicit PlaneAuthor(std::uint64_t shape) : dice_(shape) {}

    Mechanism make() { return dice_.one_in(3) ? four_bars() : plane_chain(); }

private:
    // Plane bodies on hinges, perhaps on a cart, or free and held by constraints; against angles.
    Mechanism plane_chain() {
        const int count = dice_.whole(1, 3);
        const bool is_held = dice_.one_in(2), has_cart = !is_held && dice_.one_in(2);
        Calculus calculus;
        std::vector<std::string> free, curves, by_hand;
        std::vector<Range> ranges;
        std::string bodies, joints, potential, hand, x = has_cart ? "0.6*p" : "0", y = has_cart ? "0.8*p" : "0", turn;
        std::vector<Place> definitions;
        if (has_cart) {
            free.emplace_back("p");
            ranges.insert(ranges.end(), {{"a_p", -1, 1}, {"v_p", -1, 1}});
            bodies = "cart = { mass = \"m3\", inertia = 1 }\n";
            joints =
                "rail = { type = \"slider\", bodies = [\"ground\", \"cart\"], axis = [3, 4], position = \"a_p\", "
                "velocity "
                "= \"v_p\" }\n";
            potential = " - m3*g*cart.y";
            hand = " + m3*p'^2/2 - m3*g*0.8*p";
        }
        std::string above = has_cart ? "cart" : "ground", depth = "0";
        for (int i = 1; i <= count; ++i) {
            const std::string q = fmt::format("q{}", i), m = fmt::format("m{}", i), J = fmt::format("J{}", i),
                              c = fmt::format("c{}", i), l = fmt::format("d{}", i), name = fmt::format("rod{}", i);
            free.push_back(q);
            ranges.insert(ranges.end(), {{"a_" + q, -2, 2}, {"v_" + q, -1, 1}});
            turn += (turn.empty() ? "" : " + ") + q;
            const std::string X = fmt::format("{} + {}*sin({})", x, c, turn),
                              Y = fmt::format("{} - {}*cos({})", y, c, turn);
            const std::vector<std::string> names = free;
            definitions.insert(definitions.end(),
                               {{fmt::format("X{}", i), X}, {fmt::format("Y{}", i), Y}, {fmt::format("T{}", i), turn}});
            if (is_held) {
                bodies += fmt::format(
                    "{} = {{ mass = \"{}\", inertia = \"{}\", position = [\"{}\", \"{}\"], velocity = [\"{}\", "
                    "\"{}\"], angle "
                    "= \"{}\", angular_velocity = \"{}\" }}\n",
                    name, m, J, calculus.start(X, names), calculus.start(Y, names), calculus.rate_at_start(X, names),
                    calculus.rate_at_start(Y, names), calculus.start(turn, names), calculus.rate_at_start(turn, names));
                for (const char k : {'x', 'y'})
                    joints += fmt::format("{0}{1} = \"{2}.{0}(0, {3}) = {4}\"\n", k, i, name, c,
                                          i == 1 ? "0" : fmt::format("rod{1}.{0}(0, c{1} - d{1})", k, i - 1));
            } else {
                bodies += fmt::format("{} = {{ mass = \"{}\", inertia = \"{}\", position = [0, \"{} - {}\"] }}\n", name,
                                      m, J, depth, c);
                joints += fmt::format(
                    "pin{0} = {{ type = \"hinge\", bodies = [\"{1}\", \"{2}\"], point = [0, \"{3}\"], angle = "
                    "\"a_{4}\", "
                    "velocity = \"v_{4}\" }}\n",
                    i, above, name, depth, q);
            }
            potential += fmt::format(" - {}*g*{}.y", m, name);
            hand += fmt::format(" + {0}*(X{1}'^2 + Y{1}'^2)/2 + {2}*T{1}'^2/2 - {0}*g*Y{1}", m, i, J);
            for (const char* curve : {"x", "x'", "y", "y'"}) curves.push_back(name + "." + curve);
            for (const char* curve : {"X{0}", "X{0}'", "Y{0}", "Y{0}'"})
                by_hand.push_back(fmt::format(fmt::runtime(curve), i));
            x = fmt::format("{} + {}*sin({})", x, l, turn);
            y = fmt::format("{} - {}*cos({})", y, l, turn);
            depth += " - " + l;
            above = name;
        }
        return finished(is_held ? "plane bodies, held" : "plane bodies",
                        fmt::format("lagrangian = \"0{}\"\n[bodies]\n{}[{}]\n{}", potential, bodies,
                                    is_held ? "constraints" : "joints", joints) +
                            plot_of(curves),
                        fmt::format("lagrangian = \"0{}\"\n[definitions]\n{}[coordinates]\n{}", hand,
                                    lines_of(definitions), free_coordinates(free)) +
                            plot_of(by_hand),
                        ranges);
    }

    // A loop that a fourth hinge closes, against the angle of the crank.
    Mechanism four_bars() {
        Calculus calculus;
        const std::string px = "r*cos(q1)", py = "r*sin(q1)", dx = "(f - r*cos(q1))", dy = "(-r*sin(q1))",
                          dd = "(" + dx + "^2 + " + dy + "^2)", m = "((l^2 - k^2 + " + dd + ")/(2*" + dd + "))",
                          n = "sqrt(l^2/" + dd + " - " + m + "^2)",
                          qx = px + " + " + m + "*" + dx + " - " + n + "*" + dy,
                          qy = py + " + " + m + "*" + dy + " + " + n + "*" + dx,
                          b = "2*atan((" + qy + " - " + py + ")/(" + qx + " - " + px + " + l))",
                          c = "2*atan((" + qy + ")/(" + qx + " - f + k))";
        const std::vector<std::string> free{"q1"};
        const auto at_zero = [&](const std::string& formula) {  // the place in [bodies]: the crank along x
            std::string text = calculus.start(formula, free);
            return std::regex_replace(text, std::regex("a_q1"), "0");
        };
        const std::string coupler = "(" + b + ") - q1", rocker = c;
        std::string text =
            "lagrangian = \"-m1*g*crank.y - m2*g*coupler.y - m3*g*rocker.y\"\n[bodies]\ncrank = { mass = \"m1\", "
            "inertia = "
            "\"J1\", position = [\"r/2\", 0] }\n";
        text += fmt::format(
            "coupler = {{ mass = \"m2\", inertia = \"J2\", position = [\"(r + {0})/2\", \"({1})/2\"] }}\n"
            "rocker = {{ mass = \"m3\", inertia = \"J3\", position = [\"(f + {0})/2\", \"({1})/2\"] }}\n",
            at_zero(qx), at_zero(qy));
        text +=
            "[joints]\nA = { type = \"hinge\", bodies = [\"ground\", \"crank\"], point = [0, 0], angle = \"a_q1\", "
            "velocity "
            "= \"v_q1\" }\n";
        text += fmt::format(
            "B = {{ type = \"hinge\", bodies = [\"crank\", \"coupler\"], point = [\"r\", 0], angle = \"{} - "
            "({})\", velocity = \"{}\" }}\n",
            calculus.start(coupler, free), at_zero(coupler), calculus.rate_at_start(coupler, free));
        text += fmt::format(
            "C = {{ type = \"hinge\", bodies = [\"ground\", \"rocker\"], point = [\"f\", 0], angle = \"{} - "
            "({})\", velocity = \"{}\" }}\n",
            calculus.start(rocker, free), at_zero(rocker), calculus.rate_at_start(rocker, free));
        text +=
            fmt::format("D = {{ type = \"hinge\", bodies = [\"rocker\", \"coupler\"], point = [\"{}\", \"{}\"] }}\n",
                        at_zero(qx), at_zero(qy));
        const std::string hand =
            "lagrangian = \"m1*(X1'^2 + Y1'^2)/2 + J1*q1'^2/2 + m2*(X2'^2 + Y2'^2)/2 + J2*b'^2/2 + m3*(X3'^2 + "
            "Y3'^2)/2 + "
            "J3*c'^2/2 - m1*g*Y1 - m2*g*Y2 - m3*g*Y3\"\n[definitions]\n" +
            lines_of({{"QX", qx},
                      {"QY", qy},
                      {"X1", "r*cos(q1)/2"},
                      {"Y1", "r*sin(q1)/2"},
                      {"X2", "(r*cos(q1) + QX)/2"},
                      {"Y2", "(r*sin(q1) + QY)/2"},
                      {"X3", "(f + QX)/2"},
                      {"Y3", "QY/2"},
                      {"b", b},
                      {"c", c}}) +
            "[coordinates]\n" + free_coordinates(free);
        return finished("four bars",
                        text + plot_of({"crank.x", "crank.x'", "coupler.x", "coupler.y", "coupler.x'", "coupler.y'",
                                        "rocker.x", "rocker.y'"}),
                        hand + plot_of({"X1", "X1'", "X2", "Y2", "X2'", "Y2'", "X3", "Y3'"}),
                        {{"a_q1", -3, 3}, {"v_q1", -2, 2}, {"r", 0.3, 0.9}, {"l", 2.2, 3.2}, {"k", 2, 3}, {"f", 2, 3}});
    }

    Dice dice_;
};

}  // namespace lobatto::test
