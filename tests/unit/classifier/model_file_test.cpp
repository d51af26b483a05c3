#include "classifier/fabric/model_file.hpp"

#include <bit>
#include <catch2/catch.hpp>
#include <cstdio>
#include <limits>
#include <sstream>

#include "classifier/fabric/line_text.hpp"
#include "protocols/base/crc.hpp"
#include "tests/unit/classifier/support.hpp"

namespace weft::classifier {
namespace {

constexpr std::size_t taxels = 3;

// Two or more cloths that differ in level and ripple, with all four phases.
std::vector<Trial> cloths(std::size_t classes, std::size_t per_class) {
  RandomEngine engine(7);
  std::vector<Trial> out;
  for (std::size_t i = 0; i < classes * per_class; ++i) {
    const double c = static_cast<double>(i / per_class);
    Trial trial;
    trial.file = std::to_string(i) + ".csv";
    trial.label = "cloth " + std::to_string(i / per_class);
    trial.taxels = taxels;
    for (std::size_t k = 0; k < 64; ++k) {
      trial.phase.push_back(k < 8    ? Phase::rest
                            : k < 16 ? Phase::press
                            : k < 56 ? Phase::motion
                                     : Phase::end);
      for (std::size_t t = 0; t < taxels; ++t)
        trial.counts.push_back(100.0 + 2.0 * c + (1.0 + c) * testing::normal(engine));
    }
    out.push_back(std::move(trial));
  }
  return out;
}

StoredModel trained(Reduction reduction) {
  TrainOptions options;
  options.reduction = reduction;
  options.threads = 1;
  const auto matrix = build_feature_matrix(cloths(3, 6), {}, 1);
  REQUIRE(matrix);
  auto model = train(*matrix, options);
  REQUIRE(model);
  return {std::move(*model),
          {taxels, {true, true, true}, {}, 0.0, 0.0, 0.028, "M1"},
          {"simulated", "abc123", "0.1.0", "seed 1, \"two\nlines\" and a \\"}};
}

std::string saved(const StoredModel& stored) {
  std::ostringstream out;
  REQUIRE(save_model(stored, out));
  return out.str();
}

Result<StoredModel> loaded(const std::string& text) {
  std::istringstream in(text);
  return load_model(in);
}

// `text` with a checksum that fits, so that what is tested is the parser behind it.
std::string sealed(std::string text) {
  text.resize(text.rfind("crc32 "));
  char line[32];
  std::snprintf(line, sizeof line, "crc32 %08x\n",
                crc32({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()}));
  return text + line;
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  REQUIRE(at != std::string::npos);
  return sealed(text.replace(at, from.size(), to));
}

TEST_CASE("a stored model decides exactly as the one that was saved") {
  const auto reduction = GENERATE(Reduction::pvalue, Reduction::pca, Reduction::all);
  const StoredModel before = trained(reduction);
  const auto after = loaded(saved(before));
  REQUIRE(after);
  CHECK(after->model.reduction() == reduction);
  for (const Trial& trial : cloths(3, 9)) {
    const auto a = classify(before, trial);
    const auto b = classify(*after, trial);
    REQUIRE(a);
    REQUIRE(b);
    CHECK(a->decision == b->decision);
    CHECK(a->winner == b->winner);
  }
}

TEST_CASE("saving a loaded model gives the same bytes") {
  const std::string text = saved(trained(Reduction::pvalue));
  const auto stored = loaded(text);
  REQUIRE(stored);
  CHECK(saved(*stored) == text);
}

TEST_CASE("bench kind, data set and training options travel with a model") {
  const auto stored = loaded(saved(trained(Reduction::pvalue)));
  REQUIRE(stored);
  CHECK(stored->provenance.bench == "simulated");
  CHECK(stored->provenance.dataset_sha256 == "abc123");
  CHECK(stored->provenance.training == "seed 1, \"two\nlines\" and a \\");
  CHECK(stored->setup.exploration == "M1");
  CHECK(stored->setup.sample_period_s == 0.028);
  CHECK(stored->model.cores()[0].info().selected.size() == stored->model.cores()[0].info().inputs);
}

TEST_CASE("a model file cut short anywhere is refused") {
  const std::string text = saved(trained(Reduction::pvalue));
  for (std::size_t length = 0; length < text.size(); length += 1 + text.size() / 200)
    CHECK_FALSE(loaded(text.substr(0, length)));
  CHECK_FALSE(loaded(text.substr(0, text.size() - 1)));
}

TEST_CASE("one altered byte anywhere is noticed") {
  const std::string text = saved(trained(Reduction::pvalue));
  for (std::size_t at = 0; at < text.size(); at += 1 + text.size() / 200) {
    std::string altered = text;
    altered[at] = static_cast<char>(altered[at] ^ 0x04);
    CHECK_FALSE(loaded(altered));
  }
}

TEST_CASE("another version and another file are told apart from damage") {
  const std::string text = saved(trained(Reduction::all));
  CHECK(loaded(replaced(text, "weft-fabric-model 3", "weft-fabric-model 2")).error().code ==
        Errc::unsupported);
  CHECK(loaded("t_s,ch1\n0,1\n").error().code == Errc::parse);
  CHECK(loaded("").error().code == Errc::parse);
}

TEST_CASE("a wrong line behind a right checksum is refused with its number") {
  const std::string text = saved(trained(Reduction::pvalue));
  const auto [from, to] = GENERATE(table<std::string, std::string>({
      {"taxels 3", "taxels 4"},
      {"taxels 3", "taxels 0"},
      {"taxels 3", "taxels many"},
      {"phases SPME", "phases MESP"},
      {"bench simulated", "bench reel"},
      {"labels 3", "labels 2"},
      {"labels 3", "labels 1"},
      {"labels 3", "labels 9999"},
      {"label cloth 1", "label cloth 0"},
      {"feature mean.P", "feature mean.Q"},
      {"column ", "column 9"},
      {"inputs ", "inputs 9"},
      {"bias ", "bias nan "},
      {"gamma ", "gamma inf\nx "},
      {"support_vectors ", "support_vectors 9"},
      {"deviation ", "deviation -"},
      {"crc32 ", "more\ncrc32 "},
  }));
  CAPTURE(from, to);
  const auto stored = loaded(replaced(text, from, to));
  REQUIRE_FALSE(stored);
  CHECK(stored.error().code == Errc::corrupt);
  CHECK(stored.error().where.find("line ") != std::string::npos);
}

TEST_CASE("a trial of another sensor or with other phases is refused by name") {
  const StoredModel stored = trained(Reduction::pvalue);
  Trial fewer_phases = cloths(1, 1)[0];
  for (Phase& phase : fewer_phases.phase)
    if (phase == Phase::end) phase = Phase::none;
  const auto phases = classify(stored, fewer_phases);
  REQUIRE_FALSE(phases);
  CHECK(to_string(phases.error()).find("expected SPME, got SPM") != std::string::npos);
  Trial other_sensor = testing::motion_trial({{1, 2}, {3, 4}});
  CHECK(to_string(classify(stored, other_sensor).error()).find("expected 3 taxels, got 2") !=
        std::string::npos);
}

TEST_CASE("a model whose features are not those of its setup is not written") {
  StoredModel stored = trained(Reduction::pvalue);
  stored.setup.taxels = 4;
  std::ostringstream out;
  CHECK_FALSE(save_model(stored, out));
  CHECK(out.str().empty());
}

TEST_CASE("numbers in lines come back bit for bit") {
  const std::vector<double> values{0.1,
                                   -0.0,
                                   1.0 / 3.0,
                                   std::numeric_limits<double>::denorm_min(),
                                   std::numeric_limits<double>::max(),
                                   1e23};
  LineWriter out;
  out.numbers("x", values);
  LineReader in(out.str());
  const std::vector<double> back = in.numbers("x", values.size());
  REQUIRE(back.size() == values.size());
  for (std::size_t i = 0; i < values.size(); ++i)
    CHECK(std::bit_cast<std::uint64_t>(back[i]) == std::bit_cast<std::uint64_t>(values[i]));
}

}  // namespace
}  // namespace weft::classifier
