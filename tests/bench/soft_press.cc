// Level L2 on the bare press (docs/reference/plant.md, Integrators), compared with the prototype's
// figures of the same method, and with a stage that starts at once. SIMULATED throughout.

#include <ctime>
#include <string>

#include "tests/bench/figures.hpp"
#include "tests/bench/shipped_fabrics.hpp"
#include "tests/bench/soft_press.hpp"

namespace {

using namespace weft;
using namespace weft::sim;
using bench::Figure;
using bench::SoftPress;

constexpr int runs = 7;
const char* const peer = "prototype, on its machine";

double cpu_s() {
  return static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

ContactMaterial bare(const FabricLibrary& library, const char* name) {
  constexpr MaterialSwitches only_relaxation{true, false, false, false, false, false};
  return cut_patch(*library.find(name), library.params, library.spread, only_relaxation, 1)
      ->material;
}

template <class Contact>
double speed_of(const SoftPress& press, const Contact& contact) {
  std::vector<double> speeds;
  for (int i = 0; i < runs; ++i) {
    const double begin = cpu_s();
    const auto forces = press.forces_n(contact);
    speeds.push_back(SoftPress::length_s / (cpu_s() - begin));
  }
  return bench::median(speeds);
}

struct Row {
  const char* name;
  double step_s;
  Integrator integrator;
  double notes_error, notes_speed;
};

constexpr Row rows[] = {
    {"L2 midpoint 1 ms", 1e-3, Integrator::midpoint, SoftPress::notes_1ms_error,
     SoftPress::notes_1ms_speed},
    {"L2 midpoint 0.2 ms", 2e-4, Integrator::midpoint, 0, 0},
    {"L2 midpoint 0.1 ms", 1e-4, Integrator::midpoint, SoftPress::notes_100us_error,
     SoftPress::notes_100us_speed},
    {"L2 (adaptive 0.192 ms)", DynamicsParams{}.step_s, DynamicsParams{}.integrator, 0, 0},
    {"L2 adaptive 0.048 ms", 4.8e-5, Integrator::adaptive, 0, 0}};

void add(std::vector<Figure>& figures, const std::string& of, const SoftPress& press,
         bool as_in_notes) {
  const auto truth = press.forces_n(press.dynamic(2e-6, Integrator::midpoint));
  const auto add_row = [&](const std::string& name, const auto& contact, double error,
                           double speed) {
    const auto of_notes = [&](double value) { return as_in_notes ? value : 0; };
    figures.push_back({of + name + ", worst error",
                       SoftPress::error(press.forces_n(contact), truth),
                       "of 5 N",
                       of_notes(error) > 0 ? peer : "",
                       of_notes(error),
                       {}});
    figures.push_back({of + name + ", contact alone",
                       speed_of(press, contact),
                       "x real time",
                       of_notes(speed) > 0 ? peer : "",
                       of_notes(speed),
                       {}});
  };
  add_row("L1 at 1 ms", press.quasistatic(), SoftPress::notes_l1_error, 0);
  for (const Row& row : rows)
    add_row(row.name, press.dynamic(row.step_s, row.integrator), row.notes_error, row.notes_speed);
}

}  // namespace

int main() {
  const FabricLibrary library = bench::shipped_fabrics();
  std::vector<Figure> figures;
  for (const char* name : {"denim", "felt", "cotton"}) {
    const ContactMaterial material = bare(library, name);
    add(figures, std::string(name) + ": ", SoftPress(material), true);
    add(figures, std::string(name) + ", stage starts at once: ", SoftPress(material, 1e-6), false);
  }
  return bench::report("soft_press", figures);
}
