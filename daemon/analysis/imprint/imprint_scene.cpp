#include "daemon/analysis/imprint/imprint_scene.hpp"

#include <nlohmann/json.hpp>
#include <optional>

#include "daemon/base/file/sha256.hpp"
#include "daemon/base/version/software_version.hpp"
#include "daemon/storage/imprints/imprint_dataset.hpp"
#include "sim/plant/imprint/half_space.hpp"
#include "sim/plant/imprint/objects.hpp"
#include "sim/plant/random.hpp"

namespace weft::daemon {
namespace {

struct ObjectPress {
  const sim::ObjectSpec& object;
  bool heavy;
  std::size_t repeat;

  [[nodiscard]] std::string name() const {
    return std::string(object.name) + (heavy ? "-heavy" : "-light") +
           (repeat > 0 ? "-" + std::to_string(repeat + 1) : "");
  }
  [[nodiscard]] double force_n() const { return heavy ? sim::heavy_press_n : sim::light_press_n; }
};

/// One object on the array at one fidelity level.
class PressedObject {
 public:
  static Result<PressedObject> make(const sim::ObjectSpec& object, sim::Level level) {
    PressedObject out;
    out.bed_ = sim::bed_under(object);
    if (level != sim::Level::z_plus) return out;
    auto half_space = sim::HalfSpace::make(sim::array_side, sim::array_side, sim::taxel_spacing_m,
                                           {.modulus_pa = sim::modulus_under(object)});
    if (!half_space) return pass(half_space.error());
    out.half_space_ = std::move(*half_space);
    return out;
  }

  Result<sim::Imprint> press(const sim::HeightMap& map, double force_n) {
    return half_space_ ? half_space_->press(map, force_n) : press_winkler(map, bed_, force_n);
  }

 private:
  sim::SpringLaw bed_;
  std::optional<sim::HalfSpace> half_space_;
};

Result<classifier::imprint::Image> make_image(const ObjectPress& press, PressedObject& object,
                                              const ImprintSceneOptions& options) {
  const std::uint64_t seed = sim::mix(options.seed, press.name());
  const auto map =
      place(press.object, sim::array_side, sim::array_side, sim::taxel_spacing_m, seed);
  if (!map) return pass(map.error());
  sim::Random hand(sim::mix(seed, "hand"));
  const double overshoot = hand.uniform(0, largest_overshoot);
  const auto place_in = [&] {
    const auto room = static_cast<double>(sim::array_side - options.side + 1);
    return std::min(static_cast<std::size_t>(hand.uniform(0, room)),
                    sim::array_side - options.side);
  };
  const std::size_t row = place_in(), col = place_in();
  sim::CoverState cover;
  std::optional<sim::TaxelFrame> frame;
  for (const double force_n : {press.force_n() * (1 + overshoot), press.force_n()}) {
    const auto whole = object.press(*map, force_n);
    if (!whole) return pass(whole.error());
    const auto part = extract_part(*whole, row, col, options.side, options.side);
    if (!part) return pass(part.error());
    auto read = read_taxels(options.taxels, *part, cover, sim::mix(seed, "noise"));
    if (!read) return pass(read.error());
    frame = std::move(*read);
  }
  classifier::imprint::Image out(options.side, options.side);
  std::ranges::copy(frame->counts, out.data().begin());
  return out;
}

std::string scene_text(const ImprintSceneOptions& options) {
  nlohmann::ordered_json scene{
      {"scene", "imprint"},
      {"level", to_string(options.level)},
      {"array", {{"taxels", sim::array_side}, {"spacing_m", sim::taxel_spacing_m}}},
      {"part", options.side},
      {"bits", options.taxels.bits},
      {"full_scale_pa", options.taxels.full_scale_pa},
      {"hysteresis", options.taxels.hysteresis},
      {"noise_counts", options.taxels.noise_counts},
      {"light_n", sim::light_press_n},
      {"heavy_n", sim::heavy_press_n},
      {"largest_overshoot", largest_overshoot},
      {"presses", options.presses},
      {"seed", options.seed}};
  return scene.dump(2) + "\n";
}

}  // namespace

Result<Dataset> simulate_imprints(const ImprintSceneOptions& options) {
  if (options.level != sim::Level::z && options.level != sim::Level::z_plus)
    return fail({.code = Errc::unsupported,
                 .where = "--level",
                 .what = "fidelity level without imprints",
                 .expected = "Z or Z+",
                 .got = std::string(to_string(options.level))});
  if (options.side == 0 || options.side > sim::array_side || options.presses == 0 ||
      options.presses > 1000)
    return fail({.code = Errc::range,
                 .where = "scene imprint",
                 .what = "array part or number of presses out of range",
                 .expected = "1 to 128 taxels, 1 to 1000 presses",
                 .got = std::to_string(options.side) + " taxels, " +
                        std::to_string(options.presses) + " presses"});
  Dataset out;
  out.info.kind = BenchKind::simulated;
  out.info.name = "imprint";
  out.info.source = "scene";
  out.info.seed = options.seed;
  out.info.software_version = software_version();
  out.info.rig_json = scene_text(options);
  out.info.rig_sha256 = to_hex(Sha256().text(out.info.rig_json).finish());
  for (const sim::ObjectSpec& object : sim::ellis_objects()) {
    auto pressed = PressedObject::make(object, options.level);
    if (!pressed) return pass(pressed.error(), object.name);
    for (std::size_t repeat = 0; repeat < options.presses; ++repeat)
      for (const bool heavy : {false, true}) {
        const ObjectPress press{object, heavy, repeat};
        const auto image = make_image(press, *pressed, options);
        if (!image) return pass(image.error(), press.name());
        auto done =
            append_imprint(out, *image, press.name(), std::string(to_string(object.object_class)),
                           std::string(object.name));
        if (!done) return pass(std::move(done).error(), press.name());
      }
  }
  return out;
}

}  // namespace weft::daemon
