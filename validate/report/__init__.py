"""What a run leaves behind: texts, tables, figures, the page, and the files of its folder."""
