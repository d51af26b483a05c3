#include "daemon/analysis/handover/train_vibration.hpp"

#include <algorithm>
#include <charconv>
#include <set>

#include "daemon/pages/plot/interval_text.hpp"

namespace weft::daemon {
namespace {

namespace vibro = classifier::vibro;

constexpr double longest_window_s = 2;  // the paper went on with it
constexpr double window_step_s = 1;
constexpr std::size_t windows_of_a_texture = 100;  // the paper's
constexpr std::size_t fewest_at_random = 10;
constexpr std::size_t random_splits = 5;     // fewer tell next to nothing of their spread
constexpr std::size_t tradeoff_windows = 2;  // 1 s and 2 s
constexpr std::size_t timed_windows = 31;

vibro::MethodOptions learner_options(const HandoverHooks& hooks) {
  return {.seed = 1, .threads = hooks.threads};
}

std::set<std::string> materials_in(const RecordingSet& set) {
  std::set<std::string> out;
  for (const vibro::Recording& r : set.recordings) out.insert(r.label);
  return out;
}

Result<ChosenLearner> choose_learner(const RecordingSet& set, const HandoverHooks& hooks,
                                     const StopRequested& stop) {
  vibro::ProtocolOptions protocol;
  protocol.protocol = vibro::Protocol::groups;
  protocol.window_s = longest_window_s;
  protocol.step_s = window_step_s;
  const auto windows =
      vibro::cut_and_extract(set.recordings, protocol.window_s, vibro::places_of(protocol),
                             {vibro::Family::smmrpfft, vibro::Combine::concat}, hooks.threads);
  if (!windows) return pass(windows.error());
  const auto splits = vibro::split_windows(*windows, protocol);
  if (!splits) return pass(splits.error());
  vibro::PipelineOptions options;
  options.learner = learner_options(hooks);
  options.stop = stop;
  auto got = vibro::cross_validate_chosen(*windows, *splits, protocol.protocol,
                                          vibro::quick_methods(), options, hooks.seconds_now);
  if (!got) return pass(got.error());
  name_left_out(*got, protocol.protocol);
  return ChosenLearner{protocol.window_s,      protocol.step_s,
                       windows->matrix.size(), windows->matrix.names.size(),
                       splits->size(),         std::move(*got)};
}

std::vector<vibro::Method> learners_of_every() {
  std::vector<vibro::Method> out;
  for (const vibro::Method method : vibro::all_methods())
    if (vibro::available(method)) out.push_back(method);
  return out;
}

Result<VibroTradeoff> compare_learners(const RecordingSet& set, const HandoverHooks& hooks,
                                       const StopRequested& stop,
                                       const std::function<void(const std::string&)>& announce) {
  VibroTradeoffOptions options;
  options.methods = learners_of_every();
  options.families = {vibro::Family::smmrpfft};
  options.sources = {list_sources(set).back()};  // all channels
  options.honest = vibro::Protocol::groups;
  options.protocol.step_s = window_step_s;
  const std::size_t of_each =
      std::max<std::size_t>(set.recordings.size() / materials_in(set).size(), 1);
  options.protocol.per_recording = std::max(fewest_at_random, windows_of_a_texture / of_each);
  options.protocol.repeats = random_splits;
  options.learner = learner_options(hooks);
  options.timings = timed_windows;
  options.stop = stop;
  const classifier::SecondsNow now =
      hooks.seconds_now ? hooks.seconds_now : classifier::SecondsNow([] { return 0.0; });
  return measure_vibro_tradeoff(
      set, options, now,
      [&](std::size_t, std::size_t, const std::string& what) { announce(what); });
}

}  // namespace

Result<RecordingSet> vibration_material(const Dataset& dataset, const std::string& exploration,
                                        const std::vector<std::size_t>& group_of) {
  auto set = extract_recordings(dataset, exploration);
  if (!set) return pass(set.error());
  for (vibro::Recording& recording : set->recordings) {
    std::size_t repetition = 0;
    const std::string& text = recording.group;
    std::from_chars(text.data(), text.data() + text.size(), repetition);
    recording.group = std::to_string(group_of.at(repetition - 1) + 1);
  }
  return set;
}

std::size_t vibration_steps(const recipes::Handover& wanted) {
  constexpr std::size_t protocols = 2;
  return 1 + (wanted.learner == "every" ? protocols * tradeoff_windows : 0);
}

Result<VibrationTrainingResult> train_vibration(
    const RecordingSet& set, const recipes::Handover& wanted, const HandoverHooks& hooks,
    const StopRequested& stop, const std::function<void(const std::string&)>& announce) {
  announce("windows of " + std::to_string(set.recordings.size()) +
           " slides, a learner chosen without each group of repetitions");
  auto best = choose_learner(set, hooks, stop);
  if (!best) return pass(best.error());
  const auto labels = materials_in(set);
  VibrationTrainingResult out{std::move(*best), {}, {labels.begin(), labels.end()}};
  if (wanted.learner != "every") return out;
  auto tradeoff = compare_learners(set, hooks, stop, announce);
  if (!tradeoff) return pass(tradeoff.error());
  out.tradeoff = std::move(*tradeoff);
  return out;
}

HandoverEvaluation make_evaluation(const std::string& exploration, const std::string& file,
                                   const RecordingSet& set,
                                   const VibrationTrainingResult& training_result) {
  const vibro::CrossValidation& r = training_result.best.result;
  std::set<std::string_view> chosen;
  for (const vibro::Method method : r.chosen) chosen.insert(vibro::to_string(method));
  std::string words;
  for (const std::string_view name : chosen)
    words += (words.empty() ? "" : ", ") + std::string(name);
  return {exploration,
          file,
          words,
          training_result.best.window_s,
          set.recordings.size(),
          training_result.materials.size(),
          {r.accuracy, r.accuracy_ci95.low, r.accuracy_ci95.high},
          {r.voted_accuracy, r.voted_ci95.low, r.voted_ci95.high}};
}

}  // namespace weft::daemon
