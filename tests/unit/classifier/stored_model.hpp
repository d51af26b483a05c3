#pragma once
// Models of small trials, saved and read again, unchanged or with an altered line.

#include <catch2/catch.hpp>
#include <cstdint>
#include <cstdio>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "classifier/model/stored_model.hpp"
#include "classifier/vote/postprocessing.hpp"
#include "protocols/base/bytes.hpp"
#include "tests/unit/classifier/support.hpp"

namespace weft::classifier::testing {

inline constexpr std::size_t stored_taxels = 3;

/// Two or more fabrics that differ in level and ripple, with all four phases.
inline std::vector<Trial> cloths(std::size_t classes, std::size_t per_class) {
  RandomEngine engine(7);
  std::vector<Trial> out;
  for (std::size_t i = 0; i < classes * per_class; ++i) {
    const double c = static_cast<double>(i / per_class);
    Trial trial;
    trial.file = std::to_string(i) + ".csv";
    trial.label = "cloth " + std::to_string(i / per_class);
    trial.taxels = stored_taxels;
    for (std::size_t k = 0; k < 64; ++k) {
      trial.phase.push_back(k < 8    ? Phase::rest
                            : k < 16 ? Phase::press
                            : k < 56 ? Phase::motion
                                     : Phase::end);
      for (std::size_t t = 0; t < stored_taxels; ++t)
        trial.counts.push_back(100.0 + 2.0 * c + (1.0 + c) * normal(engine));
    }
    out.push_back(std::move(trial));
  }
  return out;
}

inline StoredModel trained(Learner kind, View view = View::plain, bool postprocess = false) {
  TrainOptions options;
  options.threads = 1;
  const auto matrix = build_feature_matrix(cloths(3, 6), {}, 1);
  REQUIRE(matrix);
  auto learner = train_recipe(*matrix, {kind, 20, view}, options);
  REQUIRE(learner);
  StoredModel out{std::move(*learner),
                  {stored_taxels, {true, true, true}, {}, 0.0, 0.0, 0.028, "M1"},
                  {"simulated", "abc123", "0.1.0", "seed 1, \"two\nlines\" and a \\"}};
  if (!postprocess) return out;
  auto postprocessing = fit_postprocessing(out.learner, *matrix, options);
  REQUIRE(postprocessing);
  out.postprocessing = std::move(*postprocessing);
  return out;
}

inline std::string saved(const StoredModel& stored) {
  std::ostringstream out;
  REQUIRE(save_model(stored, out));
  return out.str();
}

inline Result<StoredModel> loaded(const std::string& text) {
  std::istringstream in(text);
  return load_model<FeatureSetup>(in);
}

/// `text` with a correct checksum, so that the parser is tested and not the checksum.
inline std::string with_checksum(std::string text) {
  text.resize(text.rfind("crc32 "));
  char line[32];
  std::snprintf(line, sizeof line, "crc32 %08x\n",
                crc32({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()}));
  return text + line;
}

/// The same with the first `from` replaced by `to`.
inline std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  REQUIRE(at != std::string::npos);
  return with_checksum(text.replace(at, from.size(), to));
}

}  // namespace weft::classifier::testing
