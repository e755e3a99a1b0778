// Entries by name: references stay valid, names are taken once, unknown ones are told apart.
#include "autograd/base/registry.h"

#include <gtest/gtest.h>

#include "tests/support/errors.h"

namespace restage {
namespace {

struct Named {
  std::string name;
  int value = 0;
};

Registry<Named> three() { return {"colour", {{"red", 1}, {"green", 2}, {"blue", 3}}}; }

TEST(Registry, EntriesStayWhereTheyAre) {
  Registry<Named> all = three();
  const Named &red = all.get("red"), &blue = all.all().back();
  for (int i = 0; i < 1000; ++i) all.add({"shade " + std::to_string(i), i});
  EXPECT_EQ(&all.get("red"), &red);
  EXPECT_EQ(red.value, 1);
  EXPECT_EQ(&all.get("blue"), &blue);
  EXPECT_EQ(blue.value, 3);
  EXPECT_EQ(all.all().size(), 1003u);
  EXPECT_EQ(all.names()[1], "green");
  EXPECT_EQ(all.names().back(), "shade 999");
}

TEST(Registry, ANameIsTakenOnce) {
  Registry<Named> all = three();
  test::expect_error<Error>(
      [&] {
        all.add({"green", 7});
      },
      {"the colour 'green' has been registered already"});
  EXPECT_EQ(all.get("green").value, 2);
}

TEST(Registry, AnUnknownNameIsRefused) {
  const Registry<Named> all = three();
  test::expect_refused([&] { all.get("gren", "paint.yaml"); },
                       "paint.yaml: ", "there is no colour 'gren'; did you mean 'green'?");
  test::expect_refused([&] { all.get("thirteen"); }, "there is no colour 'thirteen'; ",
                       "use one of red, green, blue");
}

}  // namespace
}  // namespace restage
