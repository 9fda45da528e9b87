"""How the joints of an arm follow its tool: exact where they are asked for, joined within a tolerance."""
