"""The commands of docs/import_transcripts.md, as far as their files are made here."""
import os

import import_transcripts
from support import CliTest, PROGRAM

SAMPLES = os.path.join(os.path.dirname(os.environ["RESTAGE_MAKE_H5"]), "make_samples")
PAGE = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "docs", "import_transcripts.md")


class Transcripts(CliTest):
    def test_every_importer_reads_its_sample(self):
        import_transcripts.prepare(self.folder, SAMPLES)
        with open(PAGE, encoding="utf-8") as f:
            page = f.read()
        for _, _, command in import_transcripts.CASES:
            with self.subTest(command=command):
                self.assertIn("\n$ " + command + "\n", page, "renew docs/import_transcripts.md (import_transcripts.py)")
                if "samples/" in command:
                    code, text = import_transcripts.run(PROGRAM, self.folder, command)
                    self.assertEqual(code, 0, text)
                    self.assertIn("\nwrote ", text)
                    self.assertNotIn("skipped", text)
                    self.assertEqual(self.json("data", "verify", command.split()[-1])["problems"], [])
