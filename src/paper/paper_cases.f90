!> The beams and stops of the figures of "the paper" (Irie, Yamada and Asano 1977), and the variants in which their
!> motion is computed. A variant is a method together with a mesh, a kind of impulse and a mass matrix.
module paper_cases
   use beam_mesh, only: make_mesh, mesh_t
   use beam_model, only: beam_model_t, make_beam_model
   use beam_section, only: section_t, tapered_section
   use failures, only: failure_t
   use kinds, only: wp
   use mass_choice, only: is_redistribution_more_accurate
   use run_settings, only: impulse_momentum, impulse_nodal, law_restitution, law_three_element, method_exact, &
      method_newmark, run_settings_t, stop_settings_t
   implicit none (type, external)
   private
   public :: paper_case_t, variant_t, height_ratio, make_variants, model_of_case, stop_of_case
   public :: variant_count, coarse, fine, coarse_nodal, paper_nodal, paper_momentum, comparison_variant

   !> Mean height hbar/L of the beam in all figures of the paper.
   real(wp), parameter :: height_ratio = 0.075_wp

   !> Variants of computing motion: exact motion on the coarse or fine mesh, and Newmark's method with the time step of
   !> the paper on the coarse mesh (`paper_`). In the variants with `_nodal` an impact replaces only the velocity of the
   !> node at the stop; in the other variants it applies an impulse to the whole beam.
   integer, parameter :: coarse = 1
   integer, parameter :: fine = 2
   integer, parameter :: coarse_nodal = 3
   integer, parameter :: fine_nodal = 4
   integer, parameter :: paper_nodal = 5
   integer, parameter :: paper_momentum = 6
   integer, parameter :: variant_count = 6
   !> For each variant, the variant with which its results are compared to estimate their error. Exact motion with
   !> impulses on the whole beam is compared with that on the other mesh (the fine mesh may have the redistributed mass
   !> matrix). Newmark's steps, and exact motion with replaced nodal velocities, are compared with the other integration
   !> method on the coarse mesh, because the motion under replaced nodal velocities depends strongly on the mesh
   !> (docs/theory.md, section 14). No variant is compared with `fine_nodal`, which is only listed in the results.
   integer, parameter :: comparison_variant(variant_count) = &
      [fine, coarse, paper_nodal, coarse_nodal, coarse_nodal, coarse]

   !> One curve of a figure. The defaults are the parameters of the paper's first example.
   type :: paper_case_t
      !> Taper alpha = (h0 - h1)/L at constant mean height
      real(wp) :: taper = 0.0_wp
      !> Tip mass mu
      real(wp) :: tip_mass = 0.0_wp
      !> Position Lc/L of the stop
      real(wp) :: position = 1.0_wp
      !> Damping ratio zeta
      real(wp) :: zeta = 1.0e-3_wp
      !> Coefficient of restitution eps
      real(wp) :: restitution = 0.6_wp
      !> Preload delta
      real(wp) :: preload = 0.0_wp
      !> Stiffness ratio kappa of the three-element stop; 0: the stop is rigid
      real(wp) :: stiffness = 0.0_wp
   end type paper_case_t

   !> A variant of computing motion: mesh, integration method, kind of impulse and mass matrix.
   type :: variant_t
      !> Name in tables
      character(24) :: name = ''
      !> Number of elements of equal length
      integer :: elements = 8
      !> `method_exact` or `method_newmark`
      integer :: method = method_exact
      !> `impulse_momentum` or `impulse_nodal`
      integer :: impulse = impulse_momentum
      !> True: use the more accurate of the consistent and the redistributed mass matrix; false: always use the
      !> consistent mass matrix of the paper. Replacement of nodal velocities has a meaning of its own only with the
      !> consistent one: with the redistributed one, both kinds of impulse are the same (docs/theory.md, section 14)
      logical :: chooses_mass_matrix = .false.
   end type variant_t

contains

   !> Make the variants, indexed by their constants.
   pure subroutine make_variants(coarse_elements, fine_elements, variants)
      !> Number of elements of the coarse mesh, the mesh of the paper
      integer, intent(in) :: coarse_elements
      !> Number of elements of the fine mesh
      integer, intent(in) :: fine_elements
      type(variant_t), intent(out) :: variants(variant_count)

      variants(coarse) = variant_t('exact, coarse', coarse_elements, method_exact, impulse_momentum)
      variants(fine) = variant_t('exact, fine', fine_elements, method_exact, impulse_momentum, &
         chooses_mass_matrix=.true.)
      variants(coarse_nodal) = variant_t('exact, coarse, nodal', coarse_elements, method_exact, impulse_nodal)
      variants(fine_nodal) = variant_t('exact, fine, nodal', fine_elements, method_exact, impulse_nodal)
      variants(paper_nodal) = variant_t("paper's steps, nodal", coarse_elements, method_newmark, impulse_nodal)
      variants(paper_momentum) = variant_t("paper's steps", coarse_elements, method_newmark, impulse_momentum)
   end subroutine make_variants

   !> The assembled beam of a case.
   pure subroutine model_of_case(this, variant, model, error)
      type(paper_case_t), intent(in) :: this
      !> Variant, which determines mesh and mass matrix
      type(variant_t), intent(in) :: variant
      type(beam_model_t), intent(out) :: model
      !> Set if the mesh cannot be made
      type(failure_t), allocatable, intent(out) :: error

      type(mesh_t) :: mesh
      type(section_t) :: section
      type(run_settings_t) :: settings
      logical :: is_redistributed

      call make_mesh(variant%elements, 1.0_wp, this%position, mesh, error)
      if (allocated(error)) return
      ! heights at root and tip, in L
      section = tapered_section(height_ratio + 0.5_wp*this%taper, max(height_ratio - 0.5_wp*this%taper, 0.0_wp))
      settings%stop = stop_of_case(this, variant%impulse)
      is_redistributed = variant%chooses_mass_matrix
      if (is_redistributed) is_redistributed = is_redistribution_more_accurate(section, mesh, this%tip_mass, settings)
      call make_beam_model(section, mesh, this%tip_mass, model, is_redistributed)
   end subroutine model_of_case

   !> The stop of a case. A three-element stop has beta = 20 and c* = 0.3 as in the paper.
   pure type(stop_settings_t) function stop_of_case(this, impulse) result(stop_settings)
      type(paper_case_t), intent(in) :: this
      !> Kind of the impulse, one of the `impulse_` constants
      integer, intent(in) :: impulse

      stop_settings%position = this%position
      stop_settings%preload = this%preload
      stop_settings%restitution = this%restitution
      stop_settings%impulse = impulse
      stop_settings%law = law_restitution
      if (this%stiffness > 0.0_wp) then
         stop_settings%law = law_three_element
         stop_settings%stiffness_ratio = this%stiffness
         stop_settings%branch_ratio = 20.0_wp
         stop_settings%damper_ratio = 0.3_wp
      end if
   end function stop_of_case

end module paper_cases
