#include "audio/material.h"

#include <set>
#include <string>

#include <gtest/gtest.h>

namespace carom {
namespace {

struct PublishedRow {
  std::string name;
  double density, youngsModulus, poissonsRatio;
};

// Typed from the hand-out's table 1, in its units.
const PublishedRow kHandOut[] = {{"steel", 8940, 123.4, 0.34},
                                 {"ceramic", 2700, 72, 0.19},
                                 {"glass", 2700, 62, 0.20},
                                 {"plastic", 1200, 2.4, 0.37}};

TEST(Material, FourRowsAreTheHandOutsToTheDigit) {
  for (const PublishedRow& row : kHandOut) {
    const Material* material = findMaterial(row.name);
    ASSERT_NE(material, nullptr) << row.name;
    EXPECT_EQ(material->density, row.density) << row.name;
    EXPECT_DOUBLE_EQ(material->youngsModulus, row.youngsModulus * 1e9) << row.name;
    EXPECT_EQ(material->poissonsRatio, row.poissonsRatio) << row.name;
  }
}

TEST(Material, EveryRowIsWithinThePhysicalRangeAndNamedOnce) {
  std::set<std::string> names;
  for (const Material& material : materialTable()) {
    EXPECT_TRUE(names.insert(material.name).second) << material.name;
    EXPECT_EQ(findMaterial(material.name), &material);
    EXPECT_GT(material.density, 0.0);
    EXPECT_GT(material.youngsModulus, 0.0);
    EXPECT_GE(material.poissonsRatio, 0.0);
    EXPECT_LT(material.poissonsRatio, 0.5);
    EXPECT_GE(material.restitution, 0.0);
    EXPECT_LE(material.restitution, 1.0);
  }
  EXPECT_EQ(names.size(), 8u);
}

TEST(Material, UnknownNameHasNoRow) {
  EXPECT_EQ(findMaterial("cheese"), nullptr);
  EXPECT_EQ(findMaterial(""), nullptr);
  EXPECT_EQ(findMaterial("Steel"), nullptr);
}

TEST(Material, RubberIsNearlyIncompressible) {
  // Lindley's bulk modulus of 1150 MPa must come back from E and nu: E / (3 (1 - 2 nu)).
  const Material& rubber = *findMaterial("rubber");
  const double bulk = rubber.youngsModulus / (3.0 * (1.0 - 2.0 * rubber.poissonsRatio));
  EXPECT_NEAR(bulk, 1150e6, 0.1 * 1150e6);
}

TEST(Material, RestitutionOfAPairLiesBetweenItsBodies) {
  EXPECT_DOUBLE_EQ(combinedRestitution(0.81, 0.81), 0.81);
  EXPECT_DOUBLE_EQ(combinedRestitution(0.25, 1.0), 0.5);
  EXPECT_EQ(combinedRestitution(0.0, 0.9), 0.0);
  EXPECT_EQ(combinedRestitution(0.3, 0.7), combinedRestitution(0.7, 0.3));
}

TEST(Material, ContactModulusOfEqualBodiesIsHalfThePlaneStrainModulus) {
  const Material& glass = *findMaterial("glass");
  EXPECT_NEAR(contactModulus(glass, glass), 62e9 / (2.0 * (1.0 - 0.04)), 1.0);
}

TEST(Material, SofterBodyDecidesTheContactModulus) {
  const Material& steel = *findMaterial("steel");
  const Material& rubber = *findMaterial("rubber");
  const double rubberAlone =
      rubber.youngsModulus / (1.0 - rubber.poissonsRatio * rubber.poissonsRatio);
  EXPECT_NEAR(contactModulus(steel, rubber) / rubberAlone, 1.0, 1e-4);
  EXPECT_EQ(contactModulus(steel, rubber), contactModulus(rubber, steel));
}

}  // namespace
}  // namespace carom
