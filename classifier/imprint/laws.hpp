#pragma once
// Texture energy after Laws 1979, which Ellis 1986 (section 3.4.6) compares with.

#include <string>
#include <vector>

#include "classifier/imprint/image.hpp"

namespace weft::classifier::imprint {

enum class LawsSize {
  three,  ///< 3 x 3: products of L3 1 2 1, E3 -1 0 1, S3 -1 2 -1
  five  ///< 5 x 5: of L5 1 4 6 4 1, E5 -1 -2 0 2 1, S5 -1 0 2 0 -1, W5 -1 2 0 -2 1, R5 1 -4 6 -4 1
};

/// "laws.L3E3" is L3 down the columns and E3 along the rows. All products but the level L x L,
/// which is no texture: 8 or 24.
std::vector<std::string> laws_names(LawsSize size);

/// Mean absolute value in counts of the image convolved with each mask, where the mask lies inside;
/// 0 where it lies nowhere inside. Refuses what check(image) refuses.
Result<std::vector<double>> laws_energy(const Image& image, LawsSize size);

}  // namespace weft::classifier::imprint
