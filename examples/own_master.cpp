// A master of one's own in C++: g++ -O2 -std=c++17 examples/own_master.cpp -o out/own_master, and
// command = ["backdrive", "step", "out/own_master"] in a graph.
//
// Here the device is simulated; a real one reads its encoder and writes its motor current at the same places.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <string>

struct Port { std::uint64_t age; double position, velocity, effort; };               // of one axis
struct Asked { std::uint64_t step; double time; Port intent, force; };               // packed: all fields have eight bytes
struct Answered { double measured[3], user[3]; };                                    // position, velocity, effort

int main() {
    std::string about;                                                               // one line of JSON about the node
    for (int c; (c = std::getchar()) != EOF && c != '\n';) about.push_back(static_cast<char>(c));
    const double period = std::stod(about.substr(about.find("\"period_s\":") + 11));
    const double mass = 0.25, stiffness = 400.0, damping = 23.0;                     // kg; of the hand, N/m and N s/m
    double x = 0.0, v = 0.0, force = 0.0;
    for (Asked asked; std::fread(&asked, sizeof asked, 1, stdin) == 1;) {
        const bool known = !std::isnan(asked.intent.position);                       // what was not measured is NaN
        const double x_u = known ? asked.intent.position : 0.0, v_u = known ? asked.intent.velocity : 0.0;
        const double grip = stiffness * (x_u - x) + damping * (v_u - v);
        if (asked.step > 0) {
            v += (force + grip) / mass * period;
            x += v * period;
        }
        const double wanted = asked.force.effort;                                    // a loop that has gone quiet must not go on pushing
        force = !std::isnan(wanted) && asked.force.age <= 100 ? std::clamp(wanted, -5.0, 5.0) : 0.0;
        const Answered answered{{std::round(x / 2e-6) * 2e-6, NAN, force}, {x, v, grip}};
        if (std::fwrite(&answered, sizeof answered, 1, stdout) != 1 || std::fflush(stdout) != 0) return 1;
    }
}
