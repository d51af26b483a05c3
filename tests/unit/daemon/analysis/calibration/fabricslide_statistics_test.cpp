// Statistics of real recordings against figures computed independently of this code.

#include <catch2/catch.hpp>
#include <filesystem>

#include "daemon/analysis/calibration/statistics.hpp"
#include "daemon/storage/dataset/import.hpp"

namespace weft::daemon::calibration::fabricslide_statistics_test {

TEST_CASE("Statistics of fabricslide at grip 150 and 10 mm/s are those on record") {
  const std::filesystem::path folder = WEFT_SHARED_DIR "/data/fabricslide";
  if (!std::filesystem::exists(folder)) {
    WARN("skipped: no recordings at " << folder);
    return;
  }
  const auto dataset = import_fabricslide(folder, "*_F150_V*10mmps_*");
  REQUIRE(dataset);
  const auto view = make_recording_view(std::span(&*dataset, 1));
  REQUIRE(view);
  CHECK(view->strokes.size() == 24);
  const StatisticSet set = compute_statistics(*view);
  const auto shown = [&](const char* name, const char* cloth = "") {
    const Statistic* found = find(set.statistics, name, cloth);
    return found == nullptr ? std::nan("") : found->shown;
  };
  // shared/reference/realism.md
  CHECK(shown("modulation", "BrownCotton") == Approx(0.010).margin(0.002));
  CHECK(shown("modulation", "Denim") == Approx(0.037).margin(0.002));
  CHECK(shown("modulation_stroke", "BeigeCotton") == Approx(0.016).margin(0.002));
  CHECK(shown("modulation_stroke", "Linen") == Approx(0.059).margin(0.003));
  CHECK(shown("modulation_stroke", "Denim") == Approx(0.052).margin(0.002));
  CHECK(shown("modulation_between") == Approx(0.56).margin(0.08));
  CHECK(shown("modulation_within") == Approx(0.19).margin(0.03));
  CHECK(shown("noise") == Approx(1.4).margin(0.05));
  CHECK(shown("pattern_path") == Approx(0.005).margin(0.003));
  CHECK(shown("pattern_patch") == Approx(0.012).margin(0.003));
  CHECK(shown("level_spread") == Approx(0.42).margin(0.05));
  CHECK(shown("repetition") == Approx(0.69).margin(0.08));
  CHECK(shown("control") == Approx(0.03).margin(0.03));
}

}  // namespace weft::daemon::calibration::fabricslide_statistics_test
