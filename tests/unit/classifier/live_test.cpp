// Live votes during a stroke.

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <sstream>

#include "classifier/base/line_io.hpp"
#include "classifier/live/staged_model.hpp"
#include "tests/unit/classifier/damaged_model.hpp"
#include "tests/unit/classifier/support.hpp"

namespace weft::classifier::live_test {
namespace {

constexpr double rate_hz = 40;
constexpr std::size_t taxels = 2;

// A fabric's ripple has its own height; 8 frames of S, 8 of P, `motion` of M, 8 of E.
Trial slide(std::size_t cloth, std::size_t number, std::size_t motion) {
  RandomEngine engine(100 * cloth + number);
  Trial trial;
  trial.file = std::to_string(cloth) + "-" + std::to_string(number);
  trial.label = "cloth " + std::to_string(cloth);
  trial.group = std::to_string(number);
  trial.taxels = taxels;
  const double height = 5.0 * static_cast<double>(cloth + 1);
  for (std::size_t k = 0; k < 24 + motion; ++k) {
    const Phase phase = k < 8             ? Phase::rest
                        : k < 16          ? Phase::press
                        : k < 16 + motion ? Phase::motion
                                          : Phase::end;
    trial.phase.push_back(phase);
    for (std::size_t t = 0; t < taxels; ++t)
      trial.counts.push_back(std::round(100.0 + height * testing::normal(engine)));
  }
  return trial;
}

StagedOptions options_of_lda() {
  StagedOptions options;
  options.learner = Learner::lda;
  options.training.threads = 1;
  options.exploration = "M1";
  return options;
}

std::vector<Trial> slides(std::size_t each = 6, std::size_t motion = 120) {
  std::vector<Trial> out;
  for (std::size_t cloth = 0; cloth < 3; ++cloth)
    for (std::size_t i = 0; i < each; ++i) out.push_back(slide(cloth, i, motion));
  return out;
}

std::shared_ptr<const StagedModel> staged() {
  auto model = train_staged(slides(), rate_hz, options_of_lda());
  REQUIRE(model);
  return std::make_shared<const StagedModel>(std::move(*model));
}

std::string format_text(const StagedModel& model) {
  std::ostringstream out;
  REQUIRE(save_staged(model, out));
  return out.str();
}

Result<StagedModel> loaded_stages(const std::string& text) {
  std::istringstream in(text);
  return load_staged(in);
}

std::vector<LivePrediction> votes_of(LiveVoter& voter, const Trial& trial) {
  std::vector<LivePrediction> out;
  voter.restart();
  for (std::size_t i = 0; i < trial.samples(); ++i) {
    auto reply = voter.add(trial.phase[i], trial.row(i));
    REQUIRE(reply);
    if (*reply) out.push_back(std::move(**reply));
  }
  return out;
}

}  // namespace

TEST_CASE("stages lie close together, from half a second to the length of the slide") {
  CHECK(stage_seconds(25) == std::vector<double>{0.5, 1, 2, 3, 4, 6, 8, 12, 16, 24});
  CHECK(stage_seconds(0.7) == std::vector<double>{0.5});
  CHECK(stage_seconds(0.4).empty());
  CHECK(stage_seconds(std::nan("")).empty());
  CHECK(stage_seconds(std::numeric_limits<double>::infinity()).size() < 70);
}

TEST_CASE("the beginning of a slide is what had come by then, without phase E") {
  const Trial trial = slide(0, 0, 120);
  const Trial begun = begun_slide(trial, 50);
  CHECK(phases_of(begun) == PhaseSet{true, true, false});
  CHECK(begun.samples() == 16 + 50);
  CHECK(std::equal(begun.counts.begin(), begun.counts.end(), trial.counts.begin()));
  CHECK(begun_slide(trial, 1000).samples() == 16 + 120);
}

TEST_CASE("a stage is trained as far as every fabric has two slides of its length") {
  auto some = slides(3);
  CHECK(train_staged(some, rate_hz, options_of_lda())->stages.size() == 4);  // 0.5, 1, 2, 3 s
  some[0] = slide(0, 0, 100);
  some[1] = slide(0, 1, 100);
  CHECK(train_staged(some, rate_hz, options_of_lda())->stages.size() == 3);
  CHECK_FALSE(train_staged(slides(3, 19), rate_hz, options_of_lda()));
  CHECK_FALSE(train_staged({}, rate_hz, options_of_lda()));
  for (const double rate : {0.0, -1.0, std::nan(""), std::numeric_limits<double>::infinity()})
    CHECK_FALSE(train_staged(some, rate, options_of_lda()));
}

TEST_CASE("a rate that is off by a rounding changes no stage, and keeps the last one") {
  for (const double rate : {50.0, 50.00000000000001, 49.99999999999999}) {
    CAPTURE(rate);
    const auto model = train_staged(slides(3, 100), rate, options_of_lda());
    REQUIRE(model);
    std::vector<std::size_t> frames;
    for (std::size_t i = 0; i < model->stages.size(); ++i) {
      frames.push_back(model->stages[i].motion_frames);
      LivePrediction answer{model->slide_s(i), 0, {1.0}};
      CHECK(is_sure({0.9, stage_seconds(2)[i]}, answer));
    }
    CHECK(frames == std::vector<std::size_t>{25, 50, 100});
  }
}

TEST_CASE("slides that cannot be trained on are refused as trials are, before their length") {
  auto some = slides(3);
  some.push_back(slide(3, 0, 120));
  const auto refused = train_staged(some, rate_hz, options_of_lda());
  REQUIRE_FALSE(refused);
  CHECK(refused.error().got == "1");
  CHECK(refused.error().where == "label cloth 3");
  CHECK(train_staged({}, rate_hz, options_of_lda()).error().got == "0");
}

TEST_CASE(
    "stages end where no probability could be learnt any more; two slides of each know none") {
  auto some = slides(4, 60);
  for (std::size_t i = 0; i < some.size(); ++i)
    if (i % 4 < 2) some[i] = slide(i / 4, i % 4, 120);
  const auto model = train_staged(some, rate_hz, options_of_lda());
  REQUIRE(model);
  CHECK(model->stages.size() == 2);  // 0.5 and 1 s; only two strokes of each fabric reach 2 and 3 s
  for (const LiveStage& stage : model->stages) CHECK(stage.model.postprocessing);
  const auto few = train_staged(slides(2), rate_hz, options_of_lda());
  REQUIRE(few);
  CHECK(few->stages.size() == 4);
  for (const LiveStage& stage : few->stages) {
    CHECK_FALSE(stage.model.postprocessing);
    CHECK(stage.model.provenance.training.find("none: label cloth 0 has 2 trials") !=
          std::string::npos);
  }
}

TEST_CASE("a staged model reads back from its file unchanged, and other files are refused") {
  const auto model = staged();
  const std::string text = format_text(*model);
  const auto again = loaded_stages(text);
  REQUIRE(again);
  CHECK(format_text(*again) == text);
  CHECK(again->sample_rate_hz == rate_hz);
  for (std::size_t cut = 0; cut < text.size(); cut += 1 + text.size() / 200)
    CHECK_FALSE(loaded_stages(text.substr(0, cut)));
  CHECK_FALSE(loaded_stages(text + "x"));
  std::ostringstream plain;
  REQUIRE(save_model(model->last(), plain));
  const auto refused = loaded_stages(plain.str());
  REQUIRE_FALSE(refused);
  CHECK(refused.error().hint.find("--live") != std::string::npos);
  StagedModel swapped = *model;
  std::swap(swapped.stages[0], swapped.stages[1]);
  CHECK_FALSE(loaded_stages(format_text(swapped)));
}

// In the format of version 2: an opening, then a file of each stage.
std::string as_version_2(const StagedModel& model) {
  std::string opening = "sample_rate_hz 40\nstages " + std::to_string(model.stages.size()) + "\n";
  std::string models;
  for (const LiveStage& stage : model.stages) {
    std::ostringstream out;
    REQUIRE(save_model(stage.model, out));
    const std::string one = with_checksum("weft-fabric-model 6", testing::older_body(out.str()));
    opening +=
        "stage " + std::to_string(stage.motion_frames) + " " + std::to_string(one.size()) + "\n";
    models += one;
  }
  return with_checksum("weft-live-model 2", opening) + models;
}

TEST_CASE("a live model of version 2 is read, whole and its head, and answers the same") {
  const auto model = staged();
  const std::string text = as_version_2(*model);
  auto old = loaded_stages(text);
  REQUIRE(old);
  CHECK(old->trained_on.empty());
  old->trained_on = model->trained_on;
  CHECK(format_text(*old) == format_text(*model));
  std::istringstream in(text.substr(0, text.find("\nlabels ") + 1));
  const auto head = load_staged_head(in);
  REQUIRE(head);
  CHECK(head->setup.exploration == "M1");
  CHECK(head->sample_rate_hz == rate_hz);
  for (std::size_t cut = 0; cut < text.size(); cut += 1 + text.size() / 100)
    CHECK_FALSE(loaded_stages(text.substr(0, cut)));
  std::string altered = text;
  altered[altered.find("stage ") + 6] ^= 1;
  CHECK_FALSE(loaded_stages(altered));
  CHECK_FALSE(loaded_stages(text + "x"));
}

TEST_CASE("a live model of which any byte was altered is refused, its head where that is in it") {
  const std::string text = format_text(*train_staged(slides(3, 20), rate_hz, options_of_lda()));
  const std::size_t head_end = text.find('\n', text.find("head_crc32 ")) + 1;
  REQUIRE(head_end < text.size());
  std::size_t read = 0, head_read = 0;
  for (std::size_t at = 0; at < text.size(); ++at) {
    const bool of_the_body = at > head_end && at + 20 < text.size();
    for (const int bits : {0x01, 0x10, 0x20}) {  // another digit, another sign, the other case
      if (of_the_body && bits != 0x01) continue;
      std::string altered = text;
      altered[at] = static_cast<char>(altered[at] ^ bits);
      read += loaded_stages(altered) ? 1 : 0;
      std::istringstream in(altered);
      head_read += at < head_end && load_staged_head(in) ? 1 : 0;
    }
  }
  CHECK(read == 0);
  CHECK(head_read == 0);
}

TEST_CASE("a live model of another sample rate than its stages were trained at is refused") {
  StagedModel model = *staged();
  model.sample_rate_hz *= 1.001;
  CHECK(loaded_stages(format_text(model)).error().where == "live model");
  CHECK(loaded_stages(format_text(model)).error().got == std::to_string(1 / rate_hz) + " s");
}

TEST_CASE("a rule that waits for a stage's seconds receives that stage, at any sample rate") {
  for (const double rate : {37.0, 33.3, 49.0, 1000.0 / 30}) {
    INFO(rate);
    const auto model = train_staged(slides(), rate, options_of_lda());
    REQUIRE(model);
    const auto seconds = stage_seconds(120 / rate);
    REQUIRE(model->stages.size() == seconds.size());
    for (std::size_t k = 0; k < seconds.size(); ++k) {
      CHECK(model->slide_s(k) >= seconds[k]);
      CHECK(model->slide_s(k) < seconds[k] + 1.001 / rate);
      const LivePrediction answer{model->slide_s(k), 0, {1.0}, false};
      CHECK(is_sure({0.9, seconds[k]}, answer));
    }
  }
}

TEST_CASE(
    "the head of a staged model is read without what was learnt, and a broken one is refused") {
  const auto head_of = [](const std::string& text) {
    std::istringstream in(text);
    return load_staged_head(in);
  };
  const auto model = staged();
  const std::string text = format_text(*model);
  const std::size_t training_result = text.find("\nlabels ");
  for (const std::string& beginning : {text, text.substr(0, training_result + 1)}) {
    const auto head = head_of(beginning);
    REQUIRE(head);
    CHECK(head->sample_rate_hz == model->sample_rate_hz);
    CHECK(head->setup.exploration == "M1");
    CHECK(head->setup.taxels == taxels);
    CHECK(head->provenance.bench == "unknown");
  }
  CHECK_FALSE(head_of(text.substr(0, text.find("exploration"))));
  CHECK(head_of("weft-fabric-modes 5\n").error().code == Errc::parse);
  CHECK(head_of("weft-live-model 1\nsample_rate_hz 40\n").error().code == Errc::unsupported);
  CHECK(head_of("weft-live-model 2\nsample_rate_hz 40\n").error().code == Errc::corrupt);
  const std::string old = as_version_2(*model);
  const std::string stages = old.substr(old.find("weft-fabric-model"));
  for (const char* opening :
       {"sample_rate_hz 0\nstages 1\nstage 20 9\n", "sample_rate_hz 40\nstages 0\n",
        "sample_rate_hz 40\nstages 65\nstage 20 9\n", "sample_rate_hz 1e6\nstages 1\nstage 20 9\n",
        "sample_rate_hz 40\nstages 1\nstage 20 9\nstage 40 9\n"})
    CHECK(head_of(with_checksum("weft-live-model 2", opening) + stages).error().code ==
          Errc::corrupt);
  CHECK(head_of(with_checksum("weft-live-model 2", "sample_rate_hz 41\nstages 1\nstage 20 9\n") +
                stages)
            .error()
            .got == std::to_string(1 / rate_hz) + " s");
}

TEST_CASE("a vote is sure at its probability and not before its seconds of slide") {
  LivePrediction answer{2.0, 1, {0.1, 0.9}, false};
  CHECK(is_sure({0.9, 2.0}, answer));
  CHECK_FALSE(is_sure({0.91, 2.0}, answer));
  CHECK_FALSE(is_sure({0.9, 2.01}, answer));
  answer.none_of_these = true;
  CHECK_FALSE(is_sure({0.5, 0}, answer));
  CHECK_FALSE(is_sure({0, 0}, LivePrediction{9, 0, {}, false}));
}

TEST_CASE("at each stage the vote is that of the trial as far as it has come") {
  const auto model = staged();
  LiveVoter voter(model);
  for (const std::size_t cloth : {0, 2}) {
    const Trial trial = slide(cloth, 50, 120);
    const auto votes = votes_of(voter, trial);
    REQUIRE(votes.size() == model->stages.size());
    for (std::size_t k = 0; k < votes.size(); ++k) {
      const LiveStage& stage = model->stages[k];
      CHECK(votes[k].slide_s == Approx(static_cast<double>(stage.motion_frames) / rate_hz));
      const std::vector<Trial> begun{begun_slide(trial, stage.motion_frames)};
      const auto reply = classify(stage.model, begun);
      REQUIRE(reply);
      const Prediction& whole = reply->front();
      CHECK(votes[k].winner == whole.ballot.winner);
      CHECK(votes[k].probability == whole.probability);
      CHECK(votes[k].none_of_these == whole.none_of_these);
    }
    CHECK(model->last().learner.labels()[votes.back().winner] == trial.label);
  }
}

TEST_CASE("a frame that is no frame is refused and the votes go on") {
  LiveVoter voter(staged());
  const std::vector<double> bad{100, std::nan("")};
  CHECK_FALSE(voter.add(Phase::motion, bad));
  CHECK_FALSE(voter.add(Phase::motion, std::vector<double>{1}));
  CHECK(votes_of(voter, slide(1, 60, 20)).size() == 1);
  CHECK(votes_of(voter, slide(1, 61, 400)).size() == 4);  // longer than any training stroke
}

}  // namespace weft::classifier::live_test
