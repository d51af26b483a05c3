#include "daemon/trade/answer_timing.hpp"

#include <deque>

#include "classifier/features/extract.hpp"

namespace weft::daemon {
namespace {

using classifier::FeatureExtractor;

/// Features of one answer, the parts one behind the other, into `row`.
Status extract(FeatureExtractor& extractor, const AnswerTrials& parts, std::vector<double>& row) {
  row.clear();
  for (const classifier::Trial& trial : parts) {
    const auto features = extractor.extract(trial);
    if (!features) return pass(features.error(), trial.file);
    row.insert(row.end(), features->begin(), features->end());
  }
  return {};
}

Status time_once(const TimedAnswer& timed, FeatureExtractor& extractor,
                 const classifier::SecondsNow& now, AnswerTimes& out) {
  std::vector<std::vector<double>> rows(timed.trials->size());
  const double start = now();
  for (std::size_t k = 0; k < rows.size(); ++k)
    if (Status ok = extract(extractor, (*timed.trials)[k], rows[k]); !ok) return ok;
  const double extracted = now();
  for (const auto& row : rows)
    if (const auto winner = timed.answer(row); !winner) return pass(winner.error());
  const auto count = static_cast<double>(rows.size());
  out.vote_s.push_back((now() - extracted) / count);
  out.features_s.push_back((extracted - start) / count);
  return {};
}

}  // namespace

Result<std::vector<AnswerTimes>> AnswerTiming::run(
    std::size_t repetitions, const classifier::FeatureOptions& options,
    const classifier::SecondsNow& seconds_now) const {
  std::vector<AnswerTimes> out(all_.size());
  std::deque<FeatureExtractor> extractors;  // each keeps the tables of its own lengths
  for (std::size_t i = 0; i < all_.size(); ++i) extractors.emplace_back(options);
  for (std::size_t repetition = 0; repetition <= repetitions; ++repetition) {
    for (std::size_t i = 0; i < all_.size(); ++i) {
      AnswerTimes warming;
      AnswerTimes& times = repetition == 0 ? warming : out[i];
      if (Status ok = time_once(all_[i], extractors[i], seconds_now, times); !ok)
        return pass(ok.error());
    }
  }
  return out;
}

}  // namespace weft::daemon
