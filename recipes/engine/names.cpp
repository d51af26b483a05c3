#include "recipes/engine/engine.hpp"

namespace weft::recipes {

std::string_view to_string(Outcome outcome) {
  switch (outcome) {
    case Outcome::complete:
      return "complete";
    case Outcome::stopped:
      return "stopped";
    case Outcome::aborted:
      return "aborted";
    case Outcome::failed:
      return "failed";
    case Outcome::interrupted:
      return "interrupted";
    case Outcome::rejected:
      return "rejected";
  }
  return "unknown";
}

std::string_view to_string(Cleanup cleanup) {
  switch (cleanup) {
    case Cleanup::done:
      return "done";
    case Cleanup::partial:
      return "partial";
    case Cleanup::failed:
      return "failed";
    case Cleanup::skipped:
      return "skipped";
  }
  return "unknown";
}

std::string_view to_string(RigFact rig) {
  switch (rig) {
    case RigFact::safe:
      return "safe";
    case RigFact::holding:
      return "holding";
    case RigFact::moving:
      return "moving";
    case RigFact::unknown:
      return "unknown";
    case RigFact::latched:
      return "latched";
  }
  return "unknown";
}

std::string_view to_string(Step step) {
  switch (step) {
    case Step::ready:
      return "ready";
    case Step::clearing:
      return "clearing";
    case Step::awaiting_operator:
      return "awaiting_operator";
    case Step::mounting:
      return "mounting";
    case Step::positioning:
      return "positioning";
    case Step::biasing:
      return "biasing";
    case Step::approaching:
      return "approaching";
    case Step::seating:
      return "seating";
    case Step::lowering:
      return "lowering";
    case Step::resting:
      return "resting";
    case Step::pressing:
      return "pressing";
    case Step::holding:
      return "holding";
    case Step::sliding:
      return "sliding";
    case Step::releasing:
      return "releasing";
    case Step::ending:
      return "ending";
    case Step::retracting:
      return "retracting";
    case Step::concluding:
      return "concluding";
    case Step::held:
      return "held";
    case Step::done:
      return "done";
  }
  return "unknown";
}

}  // namespace weft::recipes
