// The memory of fabric and pads from one trial of a mounted piece to the next.

#include <catch2/catch.hpp>
#include <cmath>
#include <vector>

#include "sim/devices/bench_plant.hpp"
#include "sim/devices/replay.hpp"
#include "tests/unit/plant/support.hpp"

namespace touches_test {

using namespace weft;
using namespace weft::sim;
using namespace std::chrono_literals;

namespace {

constexpr double plate_z_m = 0.06;

BenchPlantParams params_at(Level level) {
  BenchPlantParams out;
  for (StageParams& stage : out.stages) stage = {.low = -0.2, .high = 0.2, .start = 0.03};
  out.stages[2].start = 0.045;
  out.stages[3].start = out.stages[4].start = 0;
  out.plant.level = level;
  out.plant.geometry.plate_z_m = plate_z_m;
  out.plant.geometry.tilt_axis_y_m = 0.075;
  return out;
}

/// One bench with repeated trials: down to 5 N, 4 mm along y, up.
class Strokes {
 public:
  explicit Strokes(Level level = Level::quasistatic) : plant_(params_at(level), 1) {
    plant_.record_motion(true);
  }

  using Counts = std::vector<std::array<std::uint16_t, pad_count>>;
  Counts stroke(const Patch& patch, bool same_place = true) {
    plant_.mount(patch, now_, same_place);
    frames_.clear();
    const ContactMaterial& cloth = patch.material;
    const double top_n = ContactGeometry{}.face_area_m2() * cloth.law.pressure_pa;
    const double down_m = plate_z_m - cloth.thickness_m +
                          cloth.law.lambda_m * std::log1p(5 / top_n) + 3 / Mount{}.stiffness_n_m;
    go(AxisId::z, down_m, 3s);
    Counts out = go(AxisId::y, at_y_m_ + 4e-3, 4s);
    go(AxisId::z, 0.045, 5s);
    go(AxisId::y, at_y_m_, 4s);
    motion_ = plant_.extract_motion();
    plant_.record_motion(true);
    return out;
  }
  void wait(Duration time) {
    now_ = BenchPlant::frame_start(BenchPlant::frame_at_or_after(now_ + time));
  }
  /// Frames of the last stroke, from its mounting on.
  [[nodiscard]] const Counts& frames() const { return frames_; }
  [[nodiscard]] const std::optional<BenchMotion>& motion() const { return motion_; }

 private:
  Counts go(AxisId axis, double to_m, Duration time) {
    plant_.stage(axis, now_).move_to(to_m, {4e-3, 0.02}, now_);
    Counts out;
    for (const TimePoint end = now_ + time; now_ < end;) {
      now_ += Duration(pad_timing::frame_ns);
      out.push_back(plant_.frame(now_).counts);
    }
    frames_.insert(frames_.end(), out.begin(), out.end());
    return out;
  }

  static constexpr double at_y_m_ = 0.03;
  BenchPlant plant_;
  TimePoint now_{};
  Counts frames_;
  std::optional<BenchMotion> motion_;
};

/// Without noise and errors of position: only fabric and pads remain.
Spread quiet() {
  Spread spread;
  spread.touch = {0, 0, 0};
  return spread;
}

Patch patch_of(const PatchSeeds& seeds, const Spread& spread = quiet()) {
  const FabricLibrary table = test::library();
  auto patch = cut_patch(*table.find("denim"), table.params, spread, {}, seeds);
  WEFT_ASSERT(patch.has_value());
  return *patch;
}

double rms_difference(const Strokes::Counts& a, const Strokes::Counts& b) {
  double squares = 0;
  std::size_t count = 0;
  for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i)
    for (std::size_t pad = 0; pad < pad_count; ++pad, ++count) {
      const double d = static_cast<double>(a[i][pad]) - b[i][pad];
      squares += d * d;
    }
  return std::sqrt(squares / static_cast<double>(count));
}

}  // namespace

TEST_CASE("a path that is retraced on a mounted piece gives the same signal but for the noise") {
  Strokes bench;
  const auto first = bench.stroke(patch_of({1, 2, 3}));
  bench.wait(60s);
  const auto second = bench.stroke(patch_of({1, 2, 4}));
  bench.wait(60s);
  const auto remounted = bench.stroke(patch_of({1, 3, 4}));
  bench.wait(60s);
  const auto piece = bench.stroke(patch_of({2, 2, 4}));
  const double again = rms_difference(first, second);
  CHECK(again < 6);  // 1.5 counts of noise in each, and a drift of 2
  CHECK(rms_difference(first, remounted) > 2 * again);
  CHECK(rms_difference(first, piece) > 2 * again);
}

TEST_CASE("a cloth that is touched at once remembers how it was pressed, at another place not") {
  const auto second_after = [](Duration pause, bool same_place) {
    Strokes bench;
    bench.stroke(patch_of({1, 2, 3}));
    bench.wait(pause);
    bench.stroke(patch_of({1, 2, 4}), same_place);
    REQUIRE(bench.motion());
    REQUIRE(bench.motion()->memory);
    return bench.motion()->memory->contact.relaxation;
  };
  const auto sum = [](const RelaxationState& state) {
    double total = 0;
    for (const double part : state.relaxed_n) total += std::abs(part);
    return total;
  };
  CHECK(sum(second_after(0s, true)) > 0);
  CHECK(sum(second_after(0s, false)) == 0);
  CHECK(sum(second_after(600s, true)) < 1e-6);
}

TEST_CASE("a touch is replayed from the state of the fabric, bit for bit") {
  for (const Level level : {Level::quasistatic, Level::dynamic}) {
    Strokes bench(level);
    bench.stroke(patch_of({1, 2, 3}));
    bench.stroke(patch_of({1, 2, 4}, Spread{}));
    const auto motion = bench.motion();
    REQUIRE(motion);
    const Replayed once = replay(params_at(level).plant, 1, *motion);
    CHECK(once.counts == bench.frames());
    BenchMotion fresh = *motion;
    fresh.memory.reset();
    const Replayed without = replay(params_at(level).plant, 1, fresh);
    CHECK(once.normal_n != without.normal_n);
    CHECK(once.counts != without.counts);
  }
}

}  // namespace touches_test
