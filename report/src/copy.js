// A button beside each command copies it; where the browser does not let it, the command is marked to be copied by hand.
document.querySelectorAll('.todo pre').forEach(function (pre) {
  var button = document.createElement('button');
  button.type = 'button';
  button.className = 'copy';
  button.textContent = 'copy';
  button.onclick = function () {
    var code = pre.querySelector('code');
    function said(word) {
      button.textContent = word;
      setTimeout(function () { button.textContent = 'copy'; }, 1500);
    }
    function byHand() {
      getSelection().selectAllChildren(code);
      said(document.execCommand('copy') ? 'copied' : 'marked');
    }
    if (navigator.clipboard) navigator.clipboard.writeText(code.textContent).then(function () { said('copied'); }, byHand);
    else byHand();
  };
  pre.append(button);
  // A line of a command ends between words, not behind the hyphens of an option.
  var code = pre.querySelector('code');
  code.replaceChildren.apply(code, code.textContent.split(/(\s+)/).map(function (word) {
    if (word.length > 32 || !word.trim()) return document.createTextNode(word);
    var whole = document.createElement('span');
    whole.textContent = word;
    return whole;
  }));
});
