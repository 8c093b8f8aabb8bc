// SPDX-License-Identifier: GPL-2.0-or-later
// The integrator of a scene as a textbook prints it.
#include "generator/emit/plain.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "generator/emit/function_text.hpp"
#include "generator/emit/tables.hpp"
#include "generator/mechanics/derivation.hpp"
#include "generator/programs/identifier.hpp"
#include "generator/programs/programs.hpp"

namespace lobatto {

namespace {

// The step of a system with constant mass, its inner nodes by fixed-point iteration.
const char* const solved_step = R"(
// One step of length h from x. False: the iteration did not converge, or the step does not end at finite numbers; x is
// then what it was. Try a smaller step.
//
//   v   = u - h b_1 W(q)                                 u = M^-1 p                                            (D11)
//   Q_i = q + h c_i v - h^2 sum_j A_ij W(Q_j)            inner nodes, i = 2 ... s - 1                          (D12)
//   q1  = q + h v     - h^2 sum_j b_j (1 - c_j) W(Q_j)                                                         (D16)
//   u1  = v - h sum_j b_j W(Q_j) - h b_s W(q1)           p1 = M u1                                             (D17)
static inline bool step(const Parameters& parameters, real h, State& x) {
    real u[n], v[n], Q[s][n], W[s][n];
    velocity(parameters, x.p, u);
    minus_acceleration(parameters, x.t, x.q, W[0]);
    for (int k = 0; k < n; ++k) {
        v[k] = u[k] - h * b[0] * W[0][k];
        for (int i = 1; i < s - 1; ++i) Q[i][k] = x.q[k] + h * c[i] * v[k];
    }
    // Fixed-point iteration for (D12), until its changes are rounding.
    real change = std::numeric_limits<real>::infinity();
    for (int iteration = 0; s > 2; ++iteration) {
        const real before = change;
        change = 0;
        for (int i = 1; i < s - 1; ++i) minus_acceleration(parameters, x.t + c[i] * h, Q[i], W[i]);
        for (int i = 1; i < s - 1; ++i)
            for (int k = 0; k < n; ++k) {
                real next = x.q[k] + h * c[i] * v[k];
                for (int j = 1; j < s - 1; ++j) next -= h * h * A[i - 1][j - 1] * W[j][k];
                change = larger(change, relative_change(next, Q[i][k], x.q));
                Q[i][k] = next;
            }
        if (change <= rounding && !(change < before)) break;
        if (iteration == 100 || !(change <= rounding || iteration < 4 || change < before)) return false;
    }
    State end = x;
    add_time(h, end);
    for (int k = 0; k < n; ++k) {
        end.q[k] = x.q[k] + h * v[k];
        for (int j = 1; j < s - 1; ++j) end.q[k] -= h * h * b[j] * (1 - c[j]) * W[j][k];
    }
    minus_acceleration(parameters, end.t, end.q, W[s - 1]);
    for (int k = 0; k < n; ++k) {
        u[k] = v[k] - h * b[s - 1] * W[s - 1][k];
        for (int j = 1; j < s - 1; ++j) u[k] -= h * b[j] * W[j][k];
    }
    momentum(parameters, u, end.p);
    if (!is_finite(end)) return false;
    x = end;
    return true;
}
)";

const char* const explicit_step = R"(
// One step of length h from x, by kicks and drifts in turn (D40). False: it does not end at finite numbers; x is then
// what it was.
static inline bool step(const Parameters& parameters, real h, State& x) {
    State end = x;
    real u[n], W[n];
    velocity(parameters, x.p, u);
    for (int i = 0; i < s; ++i) {
        minus_acceleration(parameters, x.t + c[i] * h, end.q, W);
        for (int k = 0; k < n; ++k) {
            u[k] -= h * b[i] * W[k];
            if (i + 1 < s) end.q[k] += h * (c[i + 1] - c[i]) * u[k];
        }
    }
    add_time(h, end);
    momentum(parameters, u, end.p);
    if (!is_finite(end)) return false;
    x = end;
    return true;
}
)";

// The step of any Lagrangian: all control points by Newton's iteration.
const char* const general_step = R"(
// A x = y, by Gaussian elimination with partial pivoting; y becomes x. False: A is singular.
static inline bool solve(int size, real* A, real* y) {
    for (int k = 0; k < size; ++k) {
        int pivot = k;
        for (int i = k + 1; i < size; ++i)
            if (std::fabs(A[i * size + k]) > std::fabs(A[pivot * size + k])) pivot = i;
        if (!(std::fabs(A[pivot * size + k]) > 0)) return false;
        for (int j = 0; j < size; ++j) std::swap(A[k * size + j], A[pivot * size + j]);
        std::swap(y[k], y[pivot]);
        for (int i = k + 1; i < size; ++i) {
            const real factor = A[i * size + k] / A[k * size + k];
            for (int j = k; j < size; ++j) A[i * size + j] -= factor * A[k * size + j];
            y[i] -= factor * y[k];
        }
    }
    for (int k = size - 1; k >= 0; --k) {
        for (int j = k + 1; j < size; ++j) y[k] -= A[k * size + j] * y[j];
        y[k] /= A[k * size + k];
    }
    return true;
}

// The velocity that belongs to p: Newton's iteration for dL/dv(q, v) = p, from the velocity given (D27). An increment
// to where momenta have no value, as beyond the speed of light, is halved.
static inline bool velocity(const Parameters& parameters, real t, const real* q, const real* p, real* v) {
    real change = std::numeric_limits<real>::infinity(), d[n] = {};
    for (int iteration = 0; iteration < 100; ++iteration) {
        real z[Z], g[Z], H[Z * Z], M[n * n], sum = 0;
        for (int k = 0; k < n; ++k) z[k] = v[k], z[n + k] = q[k];
        node(parameters, t, z, g, H);
        for (int k = 0; k < n; ++k) sum += g[k];
        if (iteration > 0 && !std::isfinite(sum)) {
            for (int k = 0; k < n; ++k) d[k] /= 2, v[k] -= d[k];
            continue;
        }
        for (int k = 0; k < n; ++k) {
            d[k] = p[k] - g[k];
            for (int l = 0; l < n; ++l) M[k * n + l] = H[k * Z + l];
        }
        if (!solve(n, M, d)) return false;
        const real before = change;
        change = 0;
        for (int k = 0; k < n; ++k) {
            change = larger(change, relative_change(v[k] + d[k], v[k], v));
            v[k] += d[k];
        }
        if (change <= rounding && !(change < before)) return true;
    }
    return false;
}

// One step of length h from x: with the path q(tau) = sum_j l_j(tau) X_j through the control points, at the nodes c_i
//   Q_i = sum_j B_ij X_j,   V_i = (1/h) sum_j D_ij X_j                                                         (D25)
//   0 = sum_i b_i (D_ij L_v(i) + h B_ij L_q(i)) + delta_j0 p,    j = 0 ... m - 1;   unknown: X_1 ... X_m       (D28)
//   q1 = X_m,   p1 = p + h sum_i b_i L_q(i)                                                                    (D29)
// by Newton's iteration. False: it did not converge, or the step does not end at finite numbers; x is then what it was.
static inline bool step(const Parameters& parameters, real h, State& x) {
    constexpr int m = controls - 1, N = n * m;
    real X[controls][n], g[nodes][Z], J[N * N], d[N];
    State end = x;
    if (!velocity(parameters, x.t, x.q, x.p, end.v)) return false;
    for (int j = 0; j <= m; ++j)
        for (int k = 0; k < n; ++k) X[j][k] = x.q[k] + h * control[j] * end.v[k];
    real change = std::numeric_limits<real>::infinity();
    for (int iteration = 0;; ++iteration) {
        for (int r = 0; r < N; ++r) d[r] = r < n ? -x.p[r] : 0;
        for (int r = 0; r < N * N; ++r) J[r] = 0;
        for (int i = 0; i < nodes; ++i) {
            real z[Z], H[Z * Z];
            for (int k = 0; k < Z; ++k) z[k] = 0;
            for (int j = 0; j <= m; ++j)
                for (int k = 0; k < n; ++k) {
                    z[k] += D[i][j] * (X[j][k] - X[0][k]) / h;
                    z[n + k] += B[i][j] * X[j][k];
                }
            node(parameters, x.t + c[i] * h, z, g[i], H);
            for (int j = 0; j < m; ++j)
                for (int k = 0; k < n; ++k) {
                    d[j * n + k] -= b[i] * (D[i][j] * g[i][k] + h * B[i][j] * g[i][n + k]);
                    for (int l = 1; l <= m; ++l)
                        for (int r = 0; r < n; ++r)
                            J[(j * n + k) * N + (l - 1) * n + r] +=
                                b[i] * (D[i][j] * (H[k * Z + r] * D[i][l] / h + H[k * Z + n + r] * B[i][l]) +
                                        B[i][j] * (H[(n + k) * Z + r] * D[i][l] + h * H[(n + k) * Z + n + r] * B[i][l]));
                }
        }
        if (!solve(N, J, d)) return false;
        const real before = change;
        change = 0;
        for (int j = 1; j <= m; ++j)
            for (int k = 0; k < n; ++k) {
                const real next = X[j][k] + d[(j - 1) * n + k];
                change = larger(change, relative_change(next, X[j][k], x.q));
                X[j][k] = next;
            }
        if (change <= rounding && !(change < before)) break;
        if (iteration == 100 || !(change < std::numeric_limits<real>::max())) return false;
    }
    add_time(h, end);
    for (int k = 0; k < n; ++k) {
        end.q[k] = X[m][k];
        for (int i = 0; i < nodes; ++i) end.p[k] += h * b[i] * g[i][n + k];
    }
    if (!is_finite(end) || !velocity(parameters, end.t, end.q, end.p, end.v)) return false;
    x = end;
    return true;
}
)";

const char* const helpers = R"(
// The larger one, or not a number.
static inline real larger(real one, real other) { return one >= other || std::isnan(one) ? one : other; }
// The change of a number; what it is measured against is at least a small part of the largest of its kind, whose
// rounding it gets.
static inline real relative_change(real next, real last, const real* all) {
    real largest = 0;
    for (int k = 0; k < n; ++k) largest = larger(largest, std::fabs(all[k]));
    const real size = std::fabs(next) + std::fabs(last) + small_part * largest;
    return next == last ? 0 : std::fabs(next - last) / size;
}
// A step later; what rounding leaves out of the time is kept beside it, else it would add up.
static inline void add_time(real h, State& x) {
    const real step = h + x.t_rest, sum = x.t + step;
    x.t_rest = step - (sum - x.t);
    x.t = sum;
}
static inline bool is_finite(const State& x) {
    bool all = std::isfinite(x.t);
    for (int k = 0; k < n; ++k) all = all && std::isfinite(x.q[k]) && std::isfinite(x.p[k]);
    return all;
}
)";

std::string comment_line(const std::string& text) {
    std::string safe;
    for (const char c : text) safe += static_cast<unsigned char>(c) < 32 || c == 127 ? ' ' : c;
    while (!safe.empty() && (safe.back() == '\\' || safe.back() == ' ')) safe.pop_back();
    return safe;
}

class PlainText {
public:
    PlainText(const Derivation& derivation, const OptimisedPrograms& optimised, Precision precision,
              const std::string& name)
        : d_(derivation), p_(optimised.programs), precision_(precision), name_(name) {}

    std::string text() const {
        std::string all = preamble() +
                          "#pragma once\n\n#ifdef __FAST_MATH__\n"
                          "#error \"-Ofast and -ffast-math give wrong motions: compile this without them\"\n#endif\n\n"
                          "#include <cmath>\n#include <limits>\n";
        if (is_general()) all += "#include <utility>\n";
        all += fmt::format("\nnamespace lobatto::plain::{} {{\n\nusing real = {};\n\n", name_, type_name(precision_)) +
               shapes() + parameters() + state() + rounding() + helpers;
        if (is_general())
            all += function("dL/dv(q, v), the momentum (D2).", "void", "momentum",
                            {"real time", "const real* q", "const real* velocity", "real* p"}, "momentum") +
                   node() + general_step;
        else
            all += function("W = M^-1 (grad V - F): minus the acceleration at q (D1).", "void", "minus_acceleration",
                            {"real time", "const real* q", "real* W"}, "minus_acceleration") +
                   function("p = M v (D2).", "void", "momentum", {"const real* velocity", "real* p"}, "momentum") +
                   function("v = M^-1 p.", "void", "velocity", {"const real* p", "real* velocity"}, "velocity") +
                   (d_.quadrature.is_explicit() ? explicit_step : solved_step);
        return all + energy() + start() + fmt::format("\n}}  // namespace lobatto::plain::{}\n", name_);
    }

private:
    bool is_general() const { return d_.structure.form() == StepForm::general; }
    bool autonomous() const { return d_.system.autonomous; }

    std::string preamble() const {
        std::string text =
            fmt::format("// SPDX-License-Identifier: MIT\n// {}: {}.\n//\n", name_, comment_line(d_.scene.title));
        text += wrapped("// Lagrangian   L = " + comment_line(d_.scene.lagrangian_text), "//                  ");
        const bool forced = d_.system.has_forces();
        text += fmt::format("// Method       {}: order {}, {}\n", d_.quadrature.method.name(), d_.quadrature.order(),
                            forced ? "variational, with forces (Lagrange-d'Alembert)" : "symplectic and symmetric");
        text += fmt::format(
            "//\n"
            "// Written by Lobatto from a scene file. It needs C++17 and its standard library, nothing else: copy it\n"
            "// where you need it. Formula numbers (D..) are those of Lobatto's docs/derivation.md.\n"
            "//\n"
            "//   namespace motion = lobatto::plain::{0};\n"
            "//   motion::Parameters parameters;\n"
            "//   motion::State x = motion::start(parameters);\n"
            "//   while (x.t < 10 && motion::step(parameters, 0.01, x)) std::printf(\"%g %g\\n\", double(x.t), "
            "double(x.q[0]));\n",
            name_);
        return text;
    }

    // One row in braces for each row of a matrix.
    std::string table(const std::string& name, const GiNaC::matrix& values, const std::string& comment) const {
        std::string rows;
        for (unsigned i = 0; i < values.rows(); ++i) {
            std::string row;
            for (unsigned j = 0; j < values.cols(); ++j) row += (j > 0 ? ", " : "") + number(values(i, j));
            rows += (i > 0 ? ", {" : "{") + row + "}";
        }
        return fmt::format("// {}\n", comment) +
               wrapped(fmt::format("constexpr real {}[{}][{}] = {{{}}};", name, values.rows(), values.cols(), rows),
                       "    ");
    }
    std::string table(const std::string& name, const std::vector<GiNaC::ex>& values, const std::string& comment) const {
        std::string row;
        for (const GiNaC::ex& value : values) row += (row.empty() ? "" : ", ") + number(value);
        return fmt::format("// {}\n", comment) +
               wrapped(fmt::format("constexpr real {}[{}] = {{{}}};", name, values.size(), row), "    ");
    }
    std::string number(const GiNaC::ex& value) const {
        Graph graph;
        const Id id = graph.from(value, {});
        return formula(graph, graph.constant(graph.evaluate({}, {id})[static_cast<std::size_t>(id)]), Notation::plain,
                       {}, precision_);
    }

    std::string shapes() const {
        std::string names;
        for (int k = 0; k < d_.system.n; ++k) {
            const Coordinate& coordinate = d_.scene.coordinates[static_cast<std::size_t>(k)];
            names += fmt::format("{}q[{}] = {}{}", k > 0 ? ", " : "", k, coordinate.name,
                                 coordinate.unit.empty() ? "" : " [" + comment_line(coordinate.unit) + "]");
        }
        std::string text = wrapped(fmt::format("// Coordinates: {}", names), "// ") +
                           fmt::format("constexpr int n = {};\n", d_.system.n);
        const Quadrature& rule = d_.quadrature;
        if (is_general())
            return text + "constexpr int Z = 2 * n;  // numbers of z = (v, q)\n" +
                   fmt::format(
                       "// Points where L is evaluated, and control points of the path.\n"
                       "constexpr int nodes = {}, controls = {};\n",
                       rule.nodes.size(), rule.control.size()) +
                   table("c", rule.nodes, "Nodes of the quadrature on [0, 1].") +
                   table("b", rule.weights, "Their weights.") + table("control", rule.control, "Control points.") +
                   table("B", rule.B, "Lagrange's polynomials on the control points, at the nodes.") +
                   table("D", rule.D, "Their slopes, at the nodes.");
        text += fmt::format("// Points of a step, both ends included.\nconstexpr int s = {};\n", rule.points) +
                table("c", rule.c, "Their places in the step.") +
                table("b", rule.b, rule.is_explicit() ? "Kicks at these." : "Their weights.");
        // Without inner points there is no stage matrix, but the step that is never taken must compile.
        if (rule.is_explicit()) return text;
        return text + (rule.points > 2 ? table("A", rule.A, "Stage matrix of the inner points.")
                                       : table("A", GiNaC::matrix(1, 1), "No inner points: unused."));
    }

    std::string parameters() const {
        std::string text = "\nstruct Parameters {\n";
        for (const Parameter& parameter : d_.scene.parameters) {
            const GiNaC::numeric value = d_.scene.evaluate(parameter.value, parameter.name);
            text += fmt::format("    real {} = {};{}\n", identifier(parameter.name), number(value),
                                parameter.unit.empty() ? "" : "  // [" + comment_line(parameter.unit) + "]");
        }
        return text + "};\n";
    }
    std::string state() const {
        return fmt::format(
            "\nstruct State {{\n    real t = 0, t_rest = 0;  // the time is their sum\n    real q[n] = {{}};  // "
            "positions\n"
            "    real p[n] = {{}};  // momenta\n{}}};\n",
            is_general() ? "    real v[n] = {};  // velocities, where the next iteration for them begins\n" : "");
    }

    // float has few digits, so its rounding is measured against a larger part of the largest number.
    std::string rounding() const {
        const bool is_short = precision_ == Precision::single;
        return fmt::format(
            "\n// Relative changes this small that no longer shrink are rounding.\n"
            "constexpr real rounding = {} * std::numeric_limits<real>::epsilon();\n"
            "constexpr real small_part = {};\n",
            is_short ? 3000 : 10000000, is_short ? "real(0.0625)" : "real(0.0001)");
    }

    // A program as a function of the parameters and of `arguments`, "real time" among them where it takes the time.
    std::string function(const std::string& comment, const std::string& result, const std::string& name,
                         const std::vector<std::string>& arguments, const std::string& program) const {
        const auto found =
            std::find_if(p_.programs.begin(), p_.programs.end(), [&](const Program& p) { return p.name == program; });
        return declared(comment, result, name, arguments, body(found->outputs));
    }
    std::string body(const std::vector<Output>& outputs) const {
        const Naming names = [this](Id id) -> std::string {
            const Node& node = p_.graph[id];
            if (node.op != Op::input) return "";
            const std::string& code = p_.graph.input_of(id).code;
            return node.phase == Phase::parameter ? "parameters." + code : code;
        };
        const FunctionStyle style{precision_, Phase::constant, false, false, Notation::plain, {}};
        // The text stands in a function of a class there, in a function of a namespace here.
        std::string inner, text = FunctionText(p_, outputs, names, style).lines();
        for (std::size_t begin = 0; begin < text.size();) {
            const std::size_t end = text.find('\n', begin) + 1;
            inner += text.substr(begin + 4, end - begin - 4);
            begin = end;
        }
        return inner;
    }
    // Arguments that the body does not mention have no name.
    static std::string declared(const std::string& comment, const std::string& result, const std::string& name,
                                const std::vector<std::string>& arguments, const std::string& body) {
        std::string list = mentions(body, "parameters") ? "const Parameters& parameters" : "const Parameters&";
        for (const std::string& argument : arguments) {
            const std::size_t last = argument.find_last_of(" *&");
            const std::string type = argument.substr(0, argument[last] == ' ' ? last : last + 1);
            list += ", " + (mentions(body, argument.substr(last + 1)) ? argument : type);
        }
        return "\n" + wrapped("// " + comment, "// ") +
               wrapped(fmt::format("static inline {} {}({}) {{", result, name, list), "        ") + body + "}\n";
    }

    // g and the whole matrix H, of which most may be zero.
    std::string node() const {
        const auto found =
            std::find_if(p_.programs.begin(), p_.programs.end(), [](const Program& p) { return p.name == "node"; });
        std::vector<Output> outputs = found->outputs;
        std::size_t e = 0;
        for (const auto& [place, value] : d_.structure.routhian().second.entries())
            for (Output& output : outputs)
                if (output.target == fmt::format("H[{}]", e) && output.effect == Effect::assign) {
                    output.target = fmt::format("H[{} * Z + {}]", place.first, place.second);
                    ++e;
                    break;
                }
        return declared("At z = (v, q): g = (dL/dv, dL/dq + F) and its derivative H = dg/dz (D25).", "void", "node",
                        {"real time", "const real* z", "real* g", "real* H"},
                        "    for (int i = 0; i < Z * Z; ++i) H[i] = 0;\n" + body(outputs));
    }

    std::string energy() const {
        if (!is_general())
            return function("H(q, p) = p^T M^-1 p / 2 + V(q) (D3).", "real", "energy",
                            {"real time", "const real* q", "const real* p"}, "energy") +
                   "static inline real energy(const Parameters& values, const State& x) { return energy(values, x.t, "
                   "x.q, x.p); }\n";
        return function("H = v . dL/dv - L (D26).", "real", "energy",
                        {"real time", "const real* q", "const real* velocity"}, "energy") +
               "static inline real energy(const Parameters& values, const State& x) { return energy(values, x.t, x.q, "
               "x.v); }\n";
    }

    // The scene's start, in numbers.
    std::string start() const {
        std::string text = "    State x;\n", rates;
        const bool from_velocities = d_.scene.start == Start::velocity;
        for (std::size_t k = 0; k < d_.scene.coordinates.size(); ++k) {
            text += fmt::format("    x.q[{}] = {};\n", k, number(d_.scene.evaluate(d_.scene.initial_position[k], "a")));
            rates += fmt::format("{}{}", k > 0 ? ", " : "", number(d_.scene.evaluate(d_.scene.initial_rate[k], "a")));
        }
        if (!from_velocities) {
            text += wrapped(fmt::format("    const real p[n] = {{{}}};", rates), "        ") +
                    "    for (int k = 0; k < n; ++k) x.p[k] = p[k];\n";
            if (is_general()) text += "    velocity(parameters, x.t, x.q, x.p, x.v);\n";
        } else {
            text += wrapped(fmt::format("    const real v[n] = {{{}}};", rates), "        ");
            if (is_general()) text += "    for (int k = 0; k < n; ++k) x.v[k] = v[k];\n";
            text +=
                is_general() ? "    momentum(parameters, x.t, x.q, v, x.p);\n" : "    momentum(parameters, v, x.p);\n";
        }
        return declared("The start of the scene.", "State", "start", {}, text + "    return x;\n");
    }

    const Derivation& d_;
    const Programs& p_;
    Precision precision_;
    std::string name_;
};

}  // namespace

PlainSource emit_plain(const Derivation& derivation, const OptimisedPrograms& optimised, Precision precision) {
    PlainSource source;
    source.name = identifier(derivation.scene.name);
    source.header = PlainText(derivation, optimised, precision, source.name).text();
    return source;
}

}  // namespace lobatto
