"""The licence check, on expressions as they occur in manifests."""

import unittest

import licences


class Licences(unittest.TestCase):
    def test_a_choice_passes_when_one_way_is_open(self):
        for expression in ["MIT", "MIT/Apache-2.0", "GPL-3.0 OR MIT", "(MIT OR Apache-2.0) AND Unicode-3.0",
                           "Apache-2.0 WITH LLVM-exception", "LGPL-2.1-or-later OR (MIT AND ISC)"]:
            self.assertTrue(licences.accepted(expression), expression)

    def test_copyleft_and_unknown_licences_do_not_pass(self):
        for expression in ["AGPL-3.0-only", "GPL-3.0", "MIT AND GPL-2.0", "(MIT OR ISC) AND LGPL-3.0", "Mine-1.0"]:
            self.assertFalse(licences.accepted(expression), expression)

    def test_what_cannot_be_read_is_an_error(self):
        for expression in ["MIT OR", "(MIT", "MIT ISC", "OR MIT"]:
            with self.assertRaises(ValueError, msg=expression):
                licences.accepted(expression)

    def test_a_crate_without_a_licence_is_named(self):
        package = {"name": "odd", "version": "1.2.3", "license": None}
        self.assertEqual(licences.complaint(package), "odd 1.2.3: its manifest names no licence")


if __name__ == "__main__":
    unittest.main()
