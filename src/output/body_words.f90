!> Root and masses of a beam in words.
module body_words
   use body_settings, only: mass_settings_t, root_pinned, root_settings_t
   use kinds, only: wp
   use number_text, only: rounded, to_text
   use quantities, only: units_t, words_in
   use reader_units, only: reading_in
   use scene_types, only: beam_settings_t, shape_section
   use section_shapes, only: is_uniform, profile_names, profile_stepped, shape_names
   implicit none (type, external)
   private
   public :: section_in_words, root_in_words, mass_in_words, mesh_in_words

contains

   !> A section that is neither uniform nor a taper by &beam alone.
   pure function section_in_words(beam) result(words)
      type(beam_settings_t), intent(in) :: beam
      character(:), allocatable :: words

      words = 'section given by a table'
      if (beam%shape /= shape_section) return
      words = trim(shape_names(beam%section%shape))//' section, '
      if (is_uniform(beam%section)) then
         words = words//'uniform'
      else if (beam%section%profile == profile_stepped) then
         words = words//'in steps'
      else
         words = words//trim(profile_names(beam%section%profile))//' between stations'
      end if
   end function section_in_words

   !> What holds the root.
   pure function root_in_words(root, units) result(words)
      type(root_settings_t), intent(in) :: root
      !> What results are in
      type(units_t), intent(in) :: units
      character(:), allocatable :: words

      words = ''
      if (root%rotation_stiffness_ratio > 0.0_wp) words = ', spring against rotation of ' &
         //reading_in(units, 'rotational_stiffness', root%rotation_stiffness_ratio)
      if (root%translation_stiffness_ratio > 0.0_wp) words = words//', spring against displacement of ' &
         //reading_in(units, 'stiffness', root%translation_stiffness_ratio)
      if (words == '') words = ', clamped'
      if (root%kind == root_pinned) words = ', pinned'
      words = words(3:)
   end function root_in_words

   !> A mass on the beam.
   pure function mass_in_words(mass, units) result(words)
      type(mass_settings_t), intent(in) :: mass
      !> What results are in
      type(units_t), intent(in) :: units
      character(:), allocatable :: words

      words = reading_in(units, 'mass', mass%mass_ratio)//words_in(units, '{ of the beam~}')
      if (mass%rotary_inertia_ratio > 0.0_wp) words = words//', J = ' &
         //reading_in(units, 'rotary_inertia', mass%rotary_inertia_ratio)
      words = words//words_in(units, ', at {x/L~x} = ')//reading_in(units, 'length', mass%position)
   end function mass_in_words

   !> Elements and their lengths.
   pure function mesh_in_words(elements, ratio) result(words)
      integer, intent(in) :: elements
      !> l_i/l_(i+1); 0: the nodes are given
      real(wp), intent(in) :: ratio
      character(:), allocatable :: words

      words = to_text(elements)//' elements'
      if (ratio > 0.0_wp) then
         words = words//', l_i/l_(i+1) = '//rounded(ratio)
      else
         words = words//' between nodes that are given'
      end if
   end function mesh_in_words

end module body_words
