"""What `make docs` runs: the pages of docs/ and an API reference as files that a browser opens.

MkDocs Material was tried in its place. Opened from files, its search needs a script that each page
loads from a server, and so does that of its successor. This one needs no network.
"""
