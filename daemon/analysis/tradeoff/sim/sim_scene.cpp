#include "daemon/analysis/tradeoff/sim/sim_scene.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "daemon/base/text/format.hpp"

namespace weft::daemon {

namespace {

using namespace weft::sim;
using namespace paper_slide;

constexpr double acceleration_mps2 = 0.02;  // for all stages
constexpr double start_y_m = 0.03, clearance_m = 0.3e-3;
constexpr double press_mps = 1e-3, fastest_mps = 4e-3;
constexpr std::uint64_t patch_seed = 1;
constexpr MaterialSwitches without_memory{false, false, true, false, false, false};

struct Heights {
  double touch_m, pressed_m;  ///< of the z stage: at first touch; at 5 N at rest on the loading
                              ///< curve
};

Heights sample_heights(const SimCase& one) {
  const ContactMaterial& cloth = one.patch.material;
  const double top_n = one.geometry.face_area_m2() * cloth.law.pressure_pa;
  const double surface_m = plate_z_m - cloth.thickness_m;
  const double touch_m = surface_m + one.mount.hanging_extension_m();
  const double depth_m = cloth.law.lambda_m * std::log1p(set_n / top_n);
  return {touch_m, surface_m + depth_m + (set_n - one.mount.weight_n()) / one.mount.stiffness_n_m};
}

Result<SimCase> make_case(const FabricLibrary& library, const std::string& fabric,
                          const MaterialSwitches& switches = {}) {
  const Fabric* cloth = library.find(fabric);
  if (cloth == nullptr)
    return fail({.code = Errc::not_found,
                 .where = fabric,
                 .what = "unknown fabric",
                 .expected = joined(library.names())});
  auto patch = cut_patch(*cloth, library.params, library.spread, switches, patch_seed);
  if (!patch) return pass(patch.error(), fabric);
  SimCase out;
  out.name = fabric;
  out.patch = std::move(*patch);
  out.geometry.plate_z_m = plate_z_m;
  out.geometry.tilt_axis_y_m = 0.075;
  out.geometry.tilt_x = out.patch.tilt_x;
  out.geometry.tilt_y = out.patch.tilt_y;
  out.y = StagePath(start_y_m);
  return out;
}

/// Lowers the probe to 5 N; returns the time at which the stage stops.
double press(SimCase& one) {
  const Heights z = sample_heights(one);
  one.z = StagePath(z.touch_m - clearance_m);
  one.z.move(0.1, z.pressed_m, press_mps);
  return one.z.end_s();
}

void last_until(SimCase& one, double t_s) {
  one.samples = static_cast<std::size_t>(std::ceil(t_s / sim_sample_s - 1e-9));
}

void slide(SimCase& one, double at_s, double for_s) {
  one.slides = true;
  one.y.move(at_s, start_y_m + slide_mps * for_s, slide_mps);
  last_until(one, one.y.end_s());
}

/// Presses, regulates the force, then slides.
void press_and_slide(SimCase& one, double for_s) {
  const double pressed_s = press(one);
  one.loop = SimForceLoop{.from_s = pressed_s};
  slide(one, pressed_s + 0.7, for_s);
}

void add_press(SimCase& one) {
  press(one);
  last_until(one, 4);
}

void add_press_plain(SimCase& one) {
  one.mount.slack_m = 0;
  add_press(one);
}

void add_slide(SimCase& one) {
  press_and_slide(one, 6);
}

/// Friction of 1 N that drops to it from 1.3 N, bristles of 10 um, guide of 1e4 N/m. This is the
/// scene of docs/reference/plant.md, Friction. The bristles are short enough for a similar cycle.
void add_stick_slip(SimCase& one) {
  one.grid_s = sim_grid_s / 8;
  one.patch.material.friction = {
      .coefficient = 0.2, .reference_load_n = set_n, .exponent = 1, .bristle_length_m = 10e-6};
  one.dynamics.lateral_stiffness_n_m = 1e4;
  one.dynamics.static_ratio = 1.3;
  one.dynamics.friction_speed_mps = 1e3;
  const double pressed_s = press(one);
  slide(one, pressed_s + 0.3, 3);
  one.cycle_from_s = pressed_s + 0.3 + 1.5;  // transients are over
  one.cycle_to_s = pressed_s + 0.3 + 2.95;   // before the stage brakes
}

/// Presses, lifts off, and presses again at the stages' full speed.
void add_retouch(SimCase& one) {
  const Heights z = sample_heights(one);
  const double high_m = z.touch_m - clearance_m;
  one.z = StagePath(high_m);
  for (int i = 0; i < 2; ++i) {
    one.z.move(one.z.end_s() + 0.1, z.pressed_m, fastest_mps);
    one.z.move(one.z.end_s() + 0.5, high_m, fastest_mps);
  }
  last_until(one, one.z.end_s() + 0.2);
}

struct Entry {
  std::string_view name, words;
  MaterialSwitches switches;
  void (*add)(SimCase&);
};

const Entry entries[] = {
    {"press", "denim, pressed at 1 mm/s to 5 N at rest, 4 s", {}, add_press},
    {"press_plain",
     "as press, without slack, hysteresis, waviness and spread of trials: smooth equations",
     {true, false, true, false, false, false},
     add_press_plain},
    {"slide", "denim, pressed, held at 5 N by a loop at 37 Hz, 6 s at 2 mm/s", {}, add_slide},
    {"stick_slip", "5 N, 2 mm/s, a guide of 1e4 N/m, friction that falls with speed",
     without_memory, add_stick_slip},
    {"retouch", "denim, pressed, lifted off and pressed again at 4 mm/s", {}, add_retouch},
    {"fabrics17",
     "every fabric pressed at 1 mm/s, held at 5 N and slid at 2 mm/s; the worst",
     {},
     [](SimCase& one) { press_and_slide(one, 2.5); }}};

class Digest {
 public:
  void add(double value) {
    for (int i = 0; i < 64; i += 8) add_byte((std::bit_cast<std::uint64_t>(value) >> i) & 0xff);
  }
  void add(std::string_view text) {
    for (const char c : text) add_byte(static_cast<unsigned char>(c));
  }
  [[nodiscard]] std::string hex() const {
    std::string out;
    for (int i = 60; i >= 0; i -= 4) out += "0123456789abcdef"[(hash_ >> i) & 15];
    return out;
  }

 private:
  void add_byte(std::uint64_t byte) { hash_ = (hash_ ^ byte) * 0x100000001b3; }
  std::uint64_t hash_ = 0xcbf29ce484222325;  // FNV-1a
};

void add_material(Digest& digest, const ContactMaterial& m) {
  for (const double x :
       {m.law.lambda_m, m.law.pressure_pa, m.thickness_m, m.hysteresis.eta, m.hysteresis.length,
        m.relaxation.share[0], m.relaxation.share[1], m.relaxation.time_s[0],
        m.relaxation.time_s[1], m.friction.coefficient, m.friction.reference_load_n,
        m.friction.exponent, m.friction.bristle_length_m, m.waviness.height_m(0.03, 0.03),
        m.waviness.height_m(0.01, 0.05)})
    digest.add(x);
}

void add_case(Digest& digest, const SimCase& one) {
  digest.add(one.name);
  add_material(digest, one.patch.material);
  const Mount& m = one.mount;
  const DynamicsParams& d = one.dynamics;
  const ContactGeometry& g = one.geometry;
  for (const double x : {m.mass_kg,
                         m.stiffness_n_m,
                         m.slack_m,
                         m.stop_stiffness_n_m,
                         d.normal_damping,
                         d.lateral_stiffness_n_m,
                         d.lateral_damping,
                         d.static_ratio,
                         d.stribeck_speed_mps,
                         d.friction_speed_mps,
                         d.bristle_damping,
                         d.viscous_n_s_m,
                         g.plate_z_m,
                         g.face_half_width_m,
                         g.tilt_axis_y_m,
                         g.tilt_x,
                         g.tilt_y,
                         one.grid_s,
                         one.cycle_from_s,
                         one.cycle_to_s,
                         one.duration_s()})
    digest.add(x);
  if (one.loop)
    for (const double x :
         {one.loop->set_n, one.loop->gain_mps_n, one.loop->fastest_mps, one.loop->from_s})
      digest.add(x);
  for (std::size_t i = 0; i <= one.samples; ++i)
    for (const StagePath* path : {&one.y, &one.z})
      digest.add(path->at(static_cast<double>(i) * sim_sample_s));
}

}  // namespace

void StagePath::move(double at_s, double to_m, double speed_mps) {
  moves_.push_back({at_s, Profile::to_target(end_m_, 0, to_m, {speed_mps, acceleration_mps2})});
  end_m_ = to_m;
}

double StagePath::at(double t_s) const {
  double at_m = start_m_;
  for (const Move& move : moves_)
    if (t_s >= move.at_s) at_m = move.profile.position(t_s - move.at_s);
  return at_m;
}

double StagePath::end_s() const {
  return moves_.empty() ? 0 : moves_.back().at_s + moves_.back().profile.duration_s();
}

std::size_t SimCase::grid_points() const {
  return static_cast<std::size_t>(std::llround(sim_sample_s / grid_s));
}

ContactState SimCase::start() const {
  const Pose pose{.y_m = y.at(0), .z_m = z.at(0)};
  ContactState at_rest;
  at_rest.pose = pose;
  return ContactModel(geometry, mount, patch.material).step(at_rest, pose, 0);
}

Pose SimDrive::move(std::size_t from, std::size_t to, double normal_n) {
  const double from_s = static_cast<double>(from) * case_.grid_s;
  const double to_s = static_cast<double>(to) * case_.grid_s;
  if (case_.loop && from % case_.grid_points() == 0) {
    const SimForceLoop& loop = *case_.loop;
    rate_mps_ = from_s < loop.from_s ? 0
                                     : std::clamp(loop.gain_mps_n * (loop.set_n - normal_n),
                                                  -loop.fastest_mps, loop.fastest_mps);
  }
  offset_m_ += rate_mps_ * (to_s - from_s);
  return {.y_m = case_.y.at(to_s), .z_m = case_.z.at(to_s) + offset_m_};
}

const std::vector<std::string>& sim_scene_names() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> out;
    for (const Entry& entry : entries) out.emplace_back(entry.name);
    return out;
  }();
  return names;
}

Result<SimScene> make_sim_scene(std::string_view name, const FabricLibrary& library, bool quick) {
  const auto* const entry = std::ranges::find(entries, name, &Entry::name);
  if (entry == std::end(entries))
    return fail({.code = Errc::invalid_argument,
                 .where = "--scenes",
                 .what = "unknown scene",
                 .expected = joined(sim_scene_names()),
                 .got = std::string(name)});
  SimScene out{std::string(entry->name), std::string(entry->words), {}};
  std::vector<std::string> fabrics{"denim"};
  if (name == "fabrics17") fabrics = library.names();
  if (quick && fabrics.size() > quick_fabrics) fabrics.resize(quick_fabrics);
  for (const std::string& fabric : fabrics) {
    auto one = make_case(library, fabric, entry->switches);
    if (!one) return pass(one.error());
    entry->add(*one);
    out.cases.push_back(std::move(*one));
  }
  return out;
}

std::string sim_fingerprint(const SimScene& scene) {
  Digest digest;
  digest.add(scene.name);
  for (const SimCase& one : scene.cases) add_case(digest, one);
  return digest.hex();
}

}  // namespace weft::daemon
