// SPDX-License-Identifier: GPL-2.0-or-later
// Random mechanisms of rigid bodies on joints, and the same systems by hand: angles of Euler, turns about axes.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "tests/fuzz/mechanism_plane.hpp"

namespace lobatto::test {

using TextVector = std::array<std::string, 3>;
using TextMatrix = std::array<TextVector, 3>;

inline std::string sum_of(const std::vector<std::pair<std::string, std::string>>& products) {
    std::string text;
    for (const auto& [left, right] : products)
        if (left != "0" && right != "0") text += fmt::format("{}({})*({})", text.empty() ? "" : " + ", left, right);
    return text.empty() ? "0" : text;
}
inline TextVector operator*(const TextMatrix& A, const TextVector& x) {
    TextVector y;
    for (std::size_t i = 0; i < 3; ++i) y[i] = sum_of({{A[i][0], x[0]}, {A[i][1], x[1]}, {A[i][2], x[2]}});
    return y;
}
inline TextVector cross(const TextVector& x, const TextVector& y) {
    TextVector z;
    for (std::size_t i = 0; i < 3; ++i) {
        const std::size_t j = (i + 1) % 3, k = (i + 2) % 3;
        z[i] = sum_of({{x[j], y[k]}, {"-(" + x[k] + ")", y[j]}});
    }
    return z;
}
inline TextVector operator+(const TextVector& x, const TextVector& y) {
    return {x[0] + " + " + y[0], x[1] + " + " + y[1], x[2] + " + " + y[2]};
}
inline TextVector operator-(const TextVector& x, const TextVector& y) {
    return {x[0] + " - (" + y[0] + ")", x[1] + " - (" + y[1] + ")", x[2] + " - (" + y[2] + ")"};
}
inline std::string list_of(const TextVector& x) {
    return fmt::format("[\"{}\", \"{}\", \"{}\"]", x[0], x[1], x[2]);
}

// Turned by the angle about a unit vector.
inline TextMatrix turned(const TextVector& e, const std::string& angle) {
    TextMatrix R;
    for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t j = 0; j < 3; ++j) {
            const std::size_t k = 3 - i - j;
            R[i][j] = i == j ? fmt::format("cos({0}) + {1}^2*(1 - cos({0}))", angle, e[i])
                             : fmt::format("{1}*{2}*(1 - cos({0})) {3} {4}*sin({0})", angle, e[i], e[j],
                                           (j + 3 - i) % 3 == 1 ? "-" : "+", e[k]);
        }
    return R;
}
// A quaternion of any length, scalar part first.
inline TextMatrix turned(const std::array<double, 4>& q) {
    const double n = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
    const auto text = [&](double whole) { return fmt::format("{:.0f}/{:.0f}", whole, n); };
    return {{{text(n - 2 * (q[2] * q[2] + q[3] * q[3])), text(2 * (q[1] * q[2] - q[0] * q[3])),
              text(2 * (q[1] * q[3] + q[0] * q[2]))},
             {text(2 * (q[1] * q[2] + q[0] * q[3])), text(n - 2 * (q[1] * q[1] + q[3] * q[3])),
              text(2 * (q[2] * q[3] - q[0] * q[1]))},
             {text(2 * (q[1] * q[3] - q[0] * q[2])), text(2 * (q[2] * q[3] + q[0] * q[1])),
              text(n - 2 * (q[1] * q[1] + q[2] * q[2]))}}};
}

// Euler's angles z, x, z: f, n, s.
struct Euler {
    std::string f, n, s;
    TextMatrix rotation() const {
        const auto c = [](const std::string& x) { return "cos(" + x + ")"; };
        const auto S = [](const std::string& x) { return "sin(" + x + ")"; };
        return {{{c(f) + "*" + c(s) + " - " + S(f) + "*" + c(n) + "*" + S(s),
                  "-" + c(f) + "*" + S(s) + " - " + S(f) + "*" + c(n) + "*" + c(s), S(f) + "*" + S(n)},
                 {S(f) + "*" + c(s) + " + " + c(f) + "*" + c(n) + "*" + S(s),
                  "-" + S(f) + "*" + S(s) + " + " + c(f) + "*" + c(n) + "*" + c(s), "-" + c(f) + "*" + S(n)},
                 {S(n) + "*" + S(s), S(n) + "*" + c(s), c(n)}}};
    }
    TextVector omega(const Euler& rate) const {  // in the frame of the body
        return {fmt::format("{}*sin({})*sin({}) + {}*cos({})", rate.f, n, s, rate.n, s),
                fmt::format("{}*sin({})*cos({}) - {}*sin({})", rate.f, n, s, rate.n, s),
                fmt::format("{}*cos({}) + {}", rate.f, n, rate.s)};
    }
    std::string quaternion() const {
        return fmt::format(
            "[\"cos({0}/2)*cos(({1} + {2})/2)\", \"sin({0}/2)*cos(({1} - {2})/2)\", \"sin({0}/2)*sin(({1} - {2})/2)\", "
            "\"cos({0}/2)*sin(({1} + {2})/2)\"]",
            n, f, s);
    }
};

class BodyAuthor {
public:
    explicit BodyAuthor(std::uint64_t shape) : dice_(shape) {}

    Mechanism make() {
        switch (dice_.whole(0, 4)) {
            case 0:
                return top();
            case 1:
                return free_body();
            case 2:
                return hinges();
            case 3:
                return slide();
            default:
                return balls();
        }
    }

private:
    TextVector unit_vector() {
        return dice_.any<TextVector>({{"(1/3)", "(2/3)", "(2/3)"},
                                      {"(2/7)", "(3/7)", "(6/7)"},
                                      {"(2/3)", "(-1/3)", "(2/3)"},
                                      {"(-6/7)", "(2/7)", "(3/7)"},
                                      {"(4/9)", "(4/9)", "(7/9)"}});
    }
    // What curves of a body stand beside: its centre and two axes.
    static std::vector<std::string> curves_of(const std::string& body) {
        std::vector<std::string> all;
        for (const char* x : {"x", "y", "z"}) {
            all.push_back(fmt::format("{}.{}", body, x));
            all.push_back(fmt::format("{}.{}'", body, x));
        }
        for (int i = 1; i <= 3; ++i) {
            all.push_back(fmt::format("{}.R[{},1]", body, i));
            all.push_back(fmt::format("{}.R[{},2]", body, i));
        }
        return all;
    }
    static std::vector<std::string> curves_by_hand(const std::string& mark, const TextMatrix& R) {
        std::vector<std::string> all;
        for (const char* x : {"X", "Y", "Z"}) {
            all.push_back(x + mark);
            all.push_back(x + mark + "'");
        }
        for (const TextVector& row : R) {
            all.push_back(row[0]);
            all.push_back(row[1]);
        }
        return all;
    }
    static std::string kinetic(const std::string& mark, const std::string& mass, const std::string& inertia) {
        return fmt::format("{1}*(X{0}'^2 + Y{0}'^2 + Z{0}'^2)/2 + ({2}1*U{0}^2 + {2}2*V{0}^2 + {2}3*W{0}^2)/2", mark,
                           mass, inertia);
    }
    static std::string place_definitions(const std::string& mark, const TextVector& place, const TextVector& omega) {
        return lines_of({{"X" + mark, place[0]},
                         {"Y" + mark, place[1]},
                         {"Z" + mark, place[2]},
                         {"U" + mark, omega[0]},
                         {"V" + mark, omega[1]},
                         {"W" + mark, omega[2]}});
    }
    static void euler_ranges(std::vector<Range>& ranges) {
        ranges.push_back({"a_f", -3, 3});
        ranges.push_back({"a_n", 0.6, 2.4});
        ranges.push_back({"a_s", -3, 3});
        for (const char* rate : {"v_f", "v_n", "v_s"}) ranges.push_back({rate, -1, 1});
    }

    // A body on a ball joint, or free and held by constraints, against Euler's angles.
    Mechanism top() {
        const bool is_held = dice_.one_in(2);
        const Euler moving{"f", "n", "s"}, start{"a_f", "a_n", "a_s"}, rate{"v_f", "v_n", "v_s"};
        const TextVector centre{"c1", "c2", "c3"}, omega = moving.omega({"f'", "n'", "s'"}),
                                                   X = moving.rotation() * centre;
        const TextVector spin = start.omega(rate), speed = start.rotation() * cross(spin, centre);
        std::vector<Range> ranges;
        euler_ranges(ranges);
        const std::string body = fmt::format(
            "lagrangian = \"-m1*g*top.z - kappa*(top.x - 0.3)^2/2\"\n[bodies]\ntop = {{ mass = \"m1\", inertia = "
            "[\"J1\", "
            "\"J2\", \"J3\"], position = {}, orientation = {}, angular_velocity = {}{} }}\n",
            list_of(start.rotation() * centre), start.quaternion(), list_of(spin),
            is_held ? ", velocity = " + list_of(speed) : "");
        const std::string held =
            is_held
                ? "[constraints]\nx = \"top.x(-c1, -c2, -c3) = 0\"\ny = \"top.y(-c1, -c2, -c3) = 0\"\nz = \"top.z(-c1, "
                  "-c2, -c3) = 0\"\n"
                : "[joints]\ntip = { type = \"ball\", bodies = [\"ground\", \"top\"], point = [0, 0, 0] }\n";
        return finished(
            is_held ? "top, held" : "top", body + held + plot_of(curves_of("top")),
            fmt::format("lagrangian = \"{} - m1*g*Z - kappa*(X - 0.3)^2/2\"\n[definitions]\n{}[coordinates]\n",
                        kinetic("", "m1", "J"), place_definitions("", X, omega)) +
                free_coordinates({"f", "n", "s"}) + plot_of(curves_by_hand("", moving.rotation())),
            ranges);
    }

    // On a spring that pulls at a point of it.
    Mechanism free_body() {
        const Euler moving{"f", "n", "s"}, start{"a_f", "a_n", "a_s"}, rate{"v_f", "v_n", "v_s"};
        const TextVector omega = moving.omega({"f'", "n'", "s'"}), spin = start.omega(rate);
        std::vector<Range> ranges;
        euler_ranges(ranges);
        for (const char* x : {"a_X", "a_Y", "a_Z", "v_X", "v_Y", "v_Z"}) ranges.push_back({x, -1, 1});
        const TextVector P = TextVector{"X", "Y", "Z"} + moving.rotation() * TextVector{"c1", "0", "c3"};
        const std::string body = fmt::format(
            "lagrangian = \"-m1*g*top.z - kappa*(top.x(c1, 0, c3)^2 + top.y(c1, 0, c3)^2 + top.z(c1, 0, c3)^2)/2\"\n"
            "[bodies]\ntop = {{ mass = \"m1\", inertia = [\"J1\", \"J2\", \"J3\"], position = [\"a_X\", \"a_Y\", "
            "\"a_Z\"], "
            "velocity = [\"v_X\", \"v_Y\", \"v_Z\"], orientation = {}, angular_velocity = {} }}\n",
            start.quaternion(), list_of(spin));
        const std::string angles =
            fmt::format("lagrangian = \"{} - m1*g*Z - kappa*(PX^2 + PY^2 + PZ^2)/2\"\n[definitions]\n",
                        kinetic("", "m1", "J")) +
            lines_of({{"U", omega[0]}, {"V", omega[1]}, {"W", omega[2]}, {"PX", P[0]}, {"PY", P[1]}, {"PZ", P[2]}}) +
            "[coordinates]\n" + free_coordinates({"X", "Y", "Z", "f", "n", "s"});
        return finished("free body", body + plot_of(curves_of("top")),
                        angles + plot_of(curves_by_hand("", moving.rotation())), ranges);
    }

    // One or two hinges in space, whose axes are askew; one may be held by five constraints.
    Mechanism hinges() {
        const int count = dice_.whole(1, 2);
        const bool is_held = count == 1 && dice_.one_in(2), is_damped = !is_held && dice_.one_in(3);
        const TextVector e1 = unit_vector(), e2 = unit_vector(), centre{"c1", "c2", "c3"}, pin{"d1", "d2", "d3"},
                         beyond{"b1", "b2", "b3"};
        std::vector<Range> ranges{{"a_p", -2, 2}, {"v_p", -1, 1}, {"a_q", -2, 2}, {"v_q", -1, 1}};
        const TextMatrix first = turned(e1, "p"), at_start = turned(e1, "a_p");
        const TextVector X1 = first * centre, spin{"(" + e1[0] + ")*p'", "(" + e1[1] + ")*p'", "(" + e1[2] + ")*p'"};
        std::string bodies = "lagrangian = \"-m1*g*arm.z", joints,
                    hand = "lagrangian = \"" + kinetic("1", "m1", "J") + " - m1*g*Z1";
        std::string definitions = place_definitions("1", X1, spin);
        std::vector<std::string> curves = curves_of("arm"), by_hand = curves_by_hand("1", first), free{"p"};
        if (is_held) {
            const TextVector turn{"v_p*(" + e1[0] + ")", "v_p*(" + e1[1] + ")", "v_p*(" + e1[2] + ")"};
            bodies += fmt::format(
                "\"\n[bodies]\narm = {{ mass = \"m1\", inertia = [\"J1\", \"J2\", \"J3\"], position = {}, velocity = "
                "{}, "
                "orientation = [\"cos(a_p/2)\", \"({})*sin(a_p/2)\", \"({})*sin(a_p/2)\", \"({})*sin(a_p/2)\"], "
                "angular_velocity = {} }}\n[constraints]\n",
                list_of(at_start * centre), list_of(at_start * cross(turn, centre)), e1[0], e1[1], e1[2],
                list_of(turn));
            const std::size_t largest = e1[0] == "(-6/7)" ? 0 : 2;
            const TextVector tip = e1 - centre;
            for (std::size_t i = 0; i < 3; ++i) {
                bodies += fmt::format("pin{0} = \"arm.{1}(-c1, -c2, -c3) = 0\"\n", i, "xyz"[i]);
                if (i != largest)
                    bodies += fmt::format("axis{} = \"arm.{}({}, {}, {}) = {}\"\n", i, "xyz"[i], tip[0], tip[1], tip[2],
                                          e1[i]);
            }
        } else {
            if (count == 2) {
                bodies += " - m2*g*fore.z - kappa*(fore.x - arm.y)^2/2";
                hand += fmt::format(" + {} - m2*g*Z2 - kappa*(X2 - Y1)^2/2", kinetic("2", "m2", "I"));
                free.push_back("q");
                const TextMatrix second = turned(e2, "q");
                const TextVector X2 = first * (pin + second * beyond), inner = turned(e2, "(-q)") * spin,
                                 omega = inner +
                                         TextVector{"(" + e2[0] + ")*q'", "(" + e2[1] + ")*q'", "(" + e2[2] + ")*q'"};
                definitions += place_definitions("2", X2, omega);
                for (const char* x : {"x", "y", "z"}) curves.push_back(std::string("fore.") + x);
                for (const char* x : {"X2", "Y2", "Z2"}) by_hand.emplace_back(x);
                joints = fmt::format(
                    "elbow = {{ type = \"hinge\", bodies = [\"arm\", \"fore\"], point = {}, axis = {}, angle = "
                    "\"a_q\", "
                    "velocity = \"v_q\" }}\n",
                    list_of(pin), list_of(e2));
            }
            bodies += fmt::format(
                "\"\n[bodies]\narm = {{ mass = \"m1\", inertia = [\"J1\", \"J2\", \"J3\"], position = {} }}\n",
                list_of(centre));
            if (count == 2)
                bodies += fmt::format("fore = {{ mass = \"m2\", inertia = [\"I1\", \"I2\", \"I3\"], position = {} }}\n",
                                      list_of(pin + beyond));
            bodies += fmt::format(
                "[joints]\nshoulder = {{ type = \"hinge\", bodies = [\"ground\", \"arm\"], point = [0, 0, 0], axis = "
                "{}, "
                "angle = \"a_p\", velocity = \"v_p\" }}\n{}",
                list_of(e1), joints);
            if (is_damped) bodies += "[forces]\n\"shoulder.angle\" = \"-e*shoulder.angle'\"\n";
        }
        hand += "\"\n[definitions]\n" + definitions + "[coordinates]\n" + free_coordinates(free);
        if (is_damped) hand += "[forces]\np = \"-e*p'\"\n";
        return finished(is_held ? "hinge, held" : "hinges", bodies + plot_of(curves), hand + plot_of(by_hand), ranges,
                        !is_damped);
    }

    // A cart on a rail in space, and a body on a hinge on it.
    Mechanism slide() {
        const TextVector rail = unit_vector(), e = unit_vector(), pin{"d1", "d2", "d3"}, beyond{"b1", "b2", "b3"};
        const TextMatrix R = turned(e, "q");
        const TextVector along{"(" + rail[0] + ")*p", "(" + rail[1] + ")*p", "(" + rail[2] + ")*p"},
            X = along + (pin + R * beyond), omega{"(" + e[0] + ")*q'", "(" + e[1] + ")*q'", "(" + e[2] + ")*q'"};
        const std::string bodies = fmt::format(
            "lagrangian = \"-m1*g*cart.z - m2*g*arm.z - kappa*cart.x^2/2\"\n[bodies]\ncart = {{ mass = \"m1\", inertia "
            "= "
            "[\"J1\", \"J2\", \"J3\"] }}\narm = {{ mass = \"m2\", inertia = [\"I1\", \"I2\", \"I3\"], position = {} "
            "}}\n"
            "[joints]\nrail = {{ type = \"slider\", bodies = [\"ground\", \"cart\"], axis = {}, position = \"a_p\", "
            "velocity "
            "= \"v_p\" }}\nswing = {{ type = \"hinge\", bodies = [\"cart\", \"arm\"], point = {}, axis = {}, angle = "
            "\"a_q\", "
            "velocity = \"v_q\" }}\n",
            list_of(pin + beyond), list_of(rail), list_of(pin), list_of(e));
        const std::string hand =
            fmt::format(
                "lagrangian = \"m1*p'^2/2 + {} - m1*g*({})*p - m2*g*Z - kappa*(({})*p)^2/2\"\n[definitions]\n{}"
                "[coordinates]\n",
                kinetic("", "m2", "I"), rail[2], rail[0], place_definitions("", X, omega)) +
            free_coordinates({"p", "q"});
        return finished("slider", bodies + plot_of(curves_of("arm")), hand + plot_of(curves_by_hand("", R)),
                        {{"a_p", -1, 1}, {"v_p", -1, 1}, {"a_q", -2, 2}, {"v_q", -1, 1}});
    }

    // One or two bodies on ball joints, in the coordinates that joints leave free and held by constraints.
    Mechanism balls() {
        const int count = dice_.whole(1, 2);
        const std::vector<std::array<double, 4>> turns{{1, 0, 0, 0}, {2, 1, 0, 1}, {1, -1, 1, 0}, {3, 1, 2, -1}};
        const std::array<double, 4> q1 = dice_.any(turns), q2 = dice_.any(turns);
        const TextVector c{"c1", "c2", "c3"}, d{"d1", "d2", "d3"}, b{"b1", "b2", "b3"}, w1{"v_1", "v_2", "v_3"},
            w2{"v_4", "v_5", "v_6"};
        const TextMatrix R1 = turned(q1), R2 = turned(q2);
        const auto body = [](const std::string& name, const std::string& mass, const std::string& inertia,
                             const TextVector& place, const TextVector& speed, const std::array<double, 4>& q,
                             const TextVector& spin, bool is_held) {
            return fmt::format(
                "{0} = {{ mass = \"{1}\", inertia = [\"{3}1\", \"{3}2\", \"{3}3\"], position = {2}, orientation = "
                "[{4}, "
                "{5}, {6}, {7}], angular_velocity = {8}{9} }}\n",
                name, mass, list_of(place), inertia, q[0], q[1], q[2], q[3], list_of(spin),
                is_held ? ", velocity = " + list_of(speed) : "");
        };
        std::string texts[2];
        for (const bool is_held : {true, false}) {
            std::string& text = texts[is_held ? 0 : 1];
            text = "lagrangian = \"-m1*g*one.z - kappa*(one.x - 0.3)^2/2";
            if (count == 2) text += " - m2*g*two.z - kappa*two.y^2/2";
            text += "\"\n[bodies]\n" + body("one", "m1", "J", R1 * c, R1 * cross(w1, c), q1, w1, is_held);
            if (count == 2)
                text += body("two", "m2", "I", R1 * d + R2 * b, R1 * cross(w1, d) + R2 * cross(w2, b), q2, w2, is_held);
            text += is_held ? "[constraints]\n" : "[joints]\n";
            if (!is_held) {
                text += "a = { type = \"ball\", bodies = [\"ground\", \"one\"], point = [0, 0, 0] }\n";
                if (count == 2)
                    text += fmt::format("b = {{ type = \"ball\", bodies = [\"one\", \"two\"], point = {} }}\n",
                                        list_of(R1 * d));
            } else {
                for (const char x : {'x', 'y', 'z'}) {
                    text += fmt::format("one{0} = \"one.{0}(-c1, -c2, -c3) = 0\"\n", x);
                    if (count == 2)
                        text += fmt::format(
                            "two{0} = \"two.{0}(-b1, -b2, -b3) = one.{0}(d1 - c1, d2 - c2, d3 - c3)\"\n", x);
                }
            }
            std::vector<std::string> curves = curves_of("one");
            if (count == 2)
                for (const char* x : {"two.x", "two.y", "two.z", "two.x'", "two.R[1,1]", "two.R[2,1]", "two.R[3,2]"})
                    curves.emplace_back(x);
            text += plot_of(curves);
        }
        std::vector<Range> ranges;
        for (int i = 1; i <= 6; ++i) ranges.push_back({fmt::format("v_{}", i), -1, 1});
        return finished("balls", texts[0], texts[1], ranges);
    }

    Dice dice_;
};

}  // namespace lobatto::test
