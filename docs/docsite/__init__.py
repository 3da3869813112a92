"""Build the documentation: `python -m docsite` runs the pages' code blocks, writes the references and renders the site."""
