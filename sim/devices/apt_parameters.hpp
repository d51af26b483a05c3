#pragma once
// The parameters that an APT controller keeps: bodies as they were set, given back on request.

#include <map>

#include "protocols/apt/bodies.hpp"
#include "protocols/apt/stage_scale.hpp"
#include "protocols/base/time.hpp"

namespace weft::sim {

/// APT tables count in millimetres and degrees, the plant in metres and radians.
constexpr double si_per_unit(const protocols::apt::StageModel& model) {
  return model.axis == protocols::apt::Axis::linear ? m_per_mm : rad_per_deg;
}

class AptParameters {
 public:
  /// The stage database's defaults.
  explicit AptParameters(const protocols::apt::StageModel& model);

  enum class Outcome : std::uint8_t {
    unknown,    ///< no parameter message
    taken,      ///< a SET
    refused,    ///< a SET whose body has another length than documented
    is_request  ///< a REQ: answer with `reply`
  };
  struct Answer {
    Outcome outcome = Outcome::unknown;
    protocols::apt::MessageId reply{};
    const Bytes* body = nullptr;
  };
  Answer handle(const protocols::apt::Message& message);

  /// By the id of the SET message. There must be one: all that have a struct are there.
  [[nodiscard]] const Bytes& body(protocols::apt::MessageId set) const { return stored_.at(set); }

 private:
  std::map<protocols::apt::MessageId, Bytes> stored_;  ///< by the id of the SET message
};

}  // namespace weft::sim
